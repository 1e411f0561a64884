package flyframe.alarm

import chisel3._
import chisel3.util._
import flyframe.params.EscParams
import flyframe.protocol.{AppendedLayout, Command, DetectorState, Layout, RecordLayout}
import flyframe.registers.AlarmRegisters

/** The pins of the detector and of the signals beside it. */
class AlarmPins extends Bundle {

  /** See [[Detector.current]]. */
  val current = Input(UInt(3.W))
  val supply  = Output(Bool())

  /** Buzzer and lamp are on from an alarm until the master or the host clears it. */
  val buzzer = Output(Bool())
  val lamp   = Output(Bool())
}

/** What an alarm slave has beside an ordinary one: a detector, the queue of its events, and the datagram that
  * reports the oldest of them (ALARM-01 to ALARM-09). Its registers are the [[AlarmRegisters]].
  */
class AlarmUnit(p: EscParams) extends Module {
  val pins = IO(new AlarmPins)

  // Settings of the host: the detector is switched on; how long its states must last, see [[Detector]]; and
  // the host's epoch and node ID, which stand in the records.
  val detect   = IO(Input(Bool()))
  val report   = IO(Input(Bool())) // true: events may be appended to frames
  val debounce = IO(Input(UInt(16.W)))
  val offTime  = IO(Input(UInt(16.W)))
  val epoch    = IO(Input(UInt(8.W)))
  val node     = IO(Input(UInt(16.W)))

  // Commands of the master.
  val clear       = IO(Input(Bool()))
  val restart     = IO(Input(Bool()))
  val acknowledge = IO(Input(Valid(UInt(16.W))))
  val confirm     = IO(Input(Valid(UInt(16.W))))
  val repeat      = IO(Input(Bool()))

  // What the registers show: the state of the detector, how many events are kept, the record of the oldest
  // event that the master has not seen, and whether buzzer and lamp are on.
  val state   = IO(Output(UInt(DetectorState.Width.W)))
  val queued  = IO(Output(UInt(log2Ceil(AlarmUnit.Depth + 1).W)))
  val record  = IO(Output(Valid(UInt((8 * RecordLayout.bytes).W))))
  val latched = IO(Output(Bool()))

  /** To [[DatagramAppender]]: there is a datagram to append, and its nibbles, the low one of each byte first.
    * It does not change while `busy`.
    */
  val pending  = IO(Output(Bool()))
  val datagram = IO(Output(Vec(2 * AppendedLayout.bytes, UInt(4.W))))
  val busy     = IO(Input(Bool()))

  private val detector = Module(new Detector(p.coreClockMhz))
  detector.current  := pins.current
  detector.enable   := detect
  detector.debounce := debounce
  detector.offTime  := offTime
  detector.restart  := restart
  pins.supply       := detector.supply
  state             := detector.state

  private val queue = Module(new AlarmQueue(AlarmUnit.Depth))
  queue.state       := detector.state
  queue.time        := detector.time
  queue.acknowledge := acknowledge
  queue.confirm     := confirm
  queue.repeat      := repeat
  queue.hold        := busy
  queued            := queue.kept

  private val event = queue.head.bits
  record.valid := queue.head.valid
  record.bits := Mux(
    queue.head.valid,
    AlarmUnit.word(RecordLayout)(
      RecordLayout.Sequence -> event.sequence,
      RecordLayout.State    -> event.state,
      RecordLayout.Epoch    -> epoch,
      RecordLayout.Time     -> event.time
    ),
    0.U
  )

  // A NOP, which every controller passes untouched.
  private val address = AlarmRegisters.Record.U(16.W)
  private val length  = RecordLayout.bytes.U(16.W)
  private val bytes = AlarmUnit.word(AppendedLayout)(
    AppendedLayout.Command -> Command.Nop.U,
    AppendedLayout.Index   -> event.sequence(7, 0),
    AppendedLayout.Adp     -> node,
    AppendedLayout.Ado     -> address,
    AppendedLayout.Length  -> length,
    AppendedLayout.Irq     -> 0.U,
    AppendedLayout.Record  -> record.bits,
    AppendedLayout.Counter -> AppendedLayout.Counted.U
  )
  pending  := queue.head.valid && report
  datagram := bytes.asTypeOf(datagram)

  // Reset: no alarm.
  private val alarm = RegInit(false.B)
  when(clear) { alarm := false.B }
    .elsewhen(detector.state === DetectorState.Alarm.U && RegNext(detector.state) =/= DetectorState.Alarm.U) {
      alarm := true.B
    }
  latched     := alarm
  pins.buzzer := alarm
  pins.lamp   := alarm
}

object AlarmUnit {

  /** Events that wait for master and server. */
  val Depth = 16

  /** All fields of a little-endian layout, given in its order, as one word. */
  private def word(layout: Layout)(fields: (Layout.Field, UInt)*): UInt = {
    require(
      fields.map(_._1) == layout.fields,
      s"The fields given are ${fields.map(_._1.name).mkString(", ")} but must be those of the layout " +
        s"${layout.name}: ${layout.fields.map(_.name).mkString(", ")}."
    )
    Cat(fields.reverse.map { case (field, value) => value.pad(8 * field.bytes) })
  }
}
