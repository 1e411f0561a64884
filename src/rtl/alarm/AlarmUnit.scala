package flyframe.alarm

import chisel3._
import chisel3.util._
import flyframe.clocks.LevelCrossing
import flyframe.lanes.Lanes
import flyframe.params.EscParams
import flyframe.protocol.{
  AppendedLayout,
  Command,
  DetectorMode,
  DetectorState,
  Layout,
  RecordLayout,
  SelfTest,
  SlaveStatus
}
import flyframe.registers.AlarmRegisters

/** The pins of the detector and of the signals beside it. */
class AlarmPins extends Bundle {

  /** See [[Detector.current]]. */
  val current = Input(UInt(3.W))
  val supply  = Output(Bool())

  /** The buzzer is on from an alarm until it is silenced, the lamp until the detector is reset. */
  val buzzer = Output(Bool())
  val lamp   = Output(Bool())

  /** The device has found its configuration damaged. Asynchronous. */
  val config_fault = Input(Bool())
}

/** What a register that counts down holds: the present value, and a new one. */
class CountDown(width: Int) extends Bundle {
  val value = Input(UInt(width.W))
  val load  = Output(Valid(UInt(width.W)))
}

/** What an alarm slave has beside an ordinary one: a detector, lamp and sounder, the queue of its records,
  * and the datagram that reports one of them (ALARM-01 to ALARM-12). Its registers are the
  * [[AlarmRegisters]].
  */
class AlarmUnit(p: EscParams) extends Module {
  val pins = IO(new AlarmPins)

  // Settings of the host: the detector is switched on; how long its states must last, see [[Detector]]; what
  // it says of itself; and its node ID.
  val detect   = IO(Input(Bool()))
  val debounce = IO(Input(UInt(16.W)))
  val changes  = IO(Input(Bool())) // of debounce, see there
  val offTime  = IO(Input(UInt(16.W)))
  val selfTest = IO(Input(UInt(8.W)))
  val epoch    = IO(Input(UInt(8.W)))
  val node     = IO(Input(UInt(16.W)))

  // Registers that count down: the mode of the detector and the seconds it has left, the milliseconds for
  // which the host is taken for alive. They are loaded only while nothing else writes registers.
  val mode          = IO(new CountDown(DetectorMode.Width))
  val seconds       = IO(new CountDown(16))
  val hostAlive     = IO(new CountDown(16))
  val registersBusy = IO(Input(Bool()))

  // Orders of master and host, see [[AlarmQueue]].
  val silence            = IO(Input(Bool()))
  val restart            = IO(Input(Bool()))
  val acknowledge        = IO(Input(Valid(new RecordAck)))
  val acknowledgeChanges = IO(Input(Bool()))
  val confirm            = IO(Input(Valid(UInt(16.W))))
  val confirmChanges     = IO(Input(Bool()))
  val newMaster          = IO(Input(Bool()))

  /** What the registers show (ALARM-10). */
  val status  = IO(Output(UInt(16.W)))
  val dropped = IO(Output(UInt(8.W)))

  /** To [[DatagramAppender]], which see. */
  val pending  = IO(Output(Bool()))
  val busy     = IO(Input(Bool()))
  val nibble   = IO(Input(UInt(AlarmUnit.NibbleBits.W)))
  val nextWord = IO(Input(UInt(AlarmUnit.WordBits.W))) // where its next nibble is
  val data     = IO(Output(UInt(4.W)))
  val reads    = IO(Input(Bool()))
  val begins   = IO(Input(Bool()))
  val takes    = IO(Input(Bool()))

  private val ticks = Module(new AlarmClock(p.coreClockMhz))

  private val detector = Module(new Detector)
  detector.current     := pins.current
  detector.enable      := detect
  detector.debounce    := debounce
  detector.changes     := changes
  detector.offTime     := offTime
  detector.restart     := restart
  detector.tenth       := ticks.tenth
  detector.millisecond := ticks.millisecond
  pins.supply          := detector.supply
  private val state = detector.state

  // Mode and heartbeat. A tick waits until it can count. Reset: none has come.
  private def counts(tick: Bool): Bool = {
    val due = RegInit(false.B)
    due := tick || (due && registersBusy)
    due && !registersBusy
  }
  private val secondOver = counts(ticks.second)
  seconds.load.valid := secondOver && seconds.value.orR
  seconds.load.bits  := seconds.value - 1.U
  mode.load.valid    := secondOver && !seconds.value(15, 1).orR
  mode.load.bits     := DetectorMode.Watch.U
  private val hostIsAlive = hostAlive.value.orR
  hostAlive.load.valid := counts(ticks.millisecond) && hostIsAlive
  hostAlive.load.bits  := hostAlive.value - 1.U

  private val disabled = mode.value === DetectorMode.Disable.U
  private val testing  = mode.value === DetectorMode.Test.U
  private val watching = !disabled && !testing
  private val modes    = Cat(disabled, testing)

  // Lamp and sounder. A new alarm is never silenced by an order that comes with it. Reset: no alarm.
  private val smoke    = state === DetectorState.Alarm.U
  private val rings    = smoke && watching && detector.supply
  private val latched  = RegInit(false.B)
  private val sounding = RegInit(false.B)
  when(silence) { sounding := false.B }
  when(rings) { latched := true.B }
  when(rings && !RegNext(rings, false.B)) { sounding := true.B }
  when(restart) {
    latched  := false.B
    sounding := false.B
  }
  pins.lamp   := latched
  pins.buzzer := sounding

  private val queue = Module(new AlarmQueue(AlarmUnit.Depth))
  queue.state              := state
  queue.test               := testing
  queue.epoch              := epoch
  queue.forget             := state === DetectorState.Off.U || disabled || modes =/= RegNext(modes, 0.U)
  queue.time               := ticks.now
  queue.wraps              := ticks.wraps
  ticks.hold               := queue.hold
  queue.acknowledge        := acknowledge
  queue.acknowledgeChanges := acknowledgeChanges
  queue.confirm            := confirm
  queue.confirmChanges     := confirmChanges
  queue.newMaster          := newMaster
  queue.busy               := busy
  dropped                  := queue.dropped

  // A record that is no alarm, and that nobody wants, gives way to others (ALARM-09). Reset: as a new one.
  private val left   = RegInit(0.U(2.W)) // times it has left, up to two
  private val passed = RegInit(0.U(4.W)) // frames since it last did, up to 15
  when(begins && !passed.andR) { passed := passed + 1.U }
  when(takes) {
    passed := 0.U
    when(!left(1)) { left := left + 1.U }
  }
  when(queue.isNew) {
    left   := 0.U
    passed := 0.U
  }

  // An ordinary master expects nothing that is appended (ALARM-09). Reset: it may be one.
  private val confirmed = RegInit(false.B)
  when(confirm.valid) { confirmed := true.B }
  pending := queue.offers && confirmed && (queue.isUrgent || !left(1) || passed.andR)

  // The datagram: a NOP, which every controller passes untouched. What is not the record is chosen by
  // nibbles.
  private val fixed = AppendedLayout
    .encode(
      AppendedLayout.Command -> Command.Nop.toLong, // the appender knows the index
      AppendedLayout.Ado     -> AlarmRegisters.State.toLong,
      AppendedLayout.Length  -> RecordLayout.bytes.toLong,
      AppendedLayout.Counter -> AppendedLayout.Counted.toLong
    )
    .flatMap(byte => Seq(byte & 0xf, byte >> 4 & 0xf))
    .zipWithIndex
    .collect { case (value, i) if value != 0 => i.U -> value.U(4.W) }
    .toSeq
  private def isIn(field: Layout.Field): Bool = nibble >= (2 * field.offset).U && nibble < (2 * field.end).U
  queue.read     := reads
  queue.readWord := nextWord - AppendedLayout.Record.word.U
  data := MuxCase(
    MuxLookup(nibble, 0.U)(fixed),
    Seq(
      isIn(AppendedLayout.Record) -> Lanes.nibbles(queue.readData, 4)(nibble(1, 0)),
      isIn(AppendedLayout.Adp)    -> Lanes.nibbles(node, 4)(nibble(1, 0))
    )
  )

  private val configuration = Module(new LevelCrossing)
  configuration.in := pins.config_fault
  status := Seq(
    SlaveStatus.Alarm         -> rings,
    SlaveStatus.Latched       -> latched,
    SlaveStatus.Sounding      -> sounding,
    SlaveStatus.Open          -> (state === DetectorState.Open.U && !disabled),
    SlaveStatus.Short         -> (state === DetectorState.Short.U && !disabled),
    SlaveStatus.Unwatched     -> !detector.supply, // nor is it enabled then
    SlaveStatus.HostDead      -> !hostIsAlive,
    SlaveStatus.Disabled      -> disabled,
    SlaveStatus.Testing       -> testing,
    SlaveStatus.TestAlarm     -> (smoke && testing),
    SlaveStatus.Waiting       -> queue.waiting,
    SlaveStatus.Dropped       -> queue.lacking,
    SlaveStatus.Unwell        -> (selfTest =/= SelfTest.Good.U),
    SlaveStatus.Configuration -> configuration.out
  ).map { case (bit, isSet) => isSet.asUInt << log2Ceil(bit) }.reduce((a, b) => a.pad(16) | b.pad(16))
}

object AlarmUnit {

  /** Records that are kept for master and server. */
  val Depth = 16

  private val NibbleBits = log2Ceil(2 * AppendedLayout.bytes)

  /** The record has no more than eight words: the highest bit of a word's number makes no difference. */
  private val WordBits = 3
}
