package flyframe.alarm

import chisel3._
import chisel3.util._
import flyframe.params.EscParams
import flyframe.registers.AlarmRegisters
import flyframe.protocol.DetectorState

/** The pins of the detector and of the signals beside it. */
class AlarmPins extends Bundle {

  /** See [[Detector.current]]. */
  val current = Input(UInt(3.W))
  val supply  = Output(Bool())

  /** Lit and sounding from an alarm on until it is cleared. */
  val buzzer = Output(Bool())
  val lamp   = Output(Bool())
}

/** What an alarm slave has beside an ordinary one: a detector, the queue of its events, and the datagram that
  * reports the oldest of them (ALARM-01 to ALARM-09).
  */
class AlarmUnit(p: EscParams) extends Module {
  val pins = IO(new AlarmPins)

  // Settings of the host.
  val detect   = IO(Input(Bool()))
  val report   = IO(Input(Bool())) // events may be appended to frames
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

  // What the registers show.
  val state   = IO(Output(UInt(DetectorState.Width.W)))
  val queued  = IO(Output(UInt(log2Ceil(AlarmUnit.Depth + 1).W)))
  val record  = IO(Output(Valid(UInt((8 * AlarmUnit.RecordBytes).W))))
  val latched = IO(Output(Bool()))

  /** For [[DatagramAppender]]. */
  val pending  = IO(Output(Bool()))
  val datagram = IO(Output(Vec(2 * AlarmUnit.DatagramBytes, UInt(4.W))))
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
    Cat(event.time, epoch, event.state.pad(8), event.sequence),
    0.U
  )

  // A NOP, which every controller passes untouched, with working counter 1.
  private val address = AlarmRegisters.Record.U(16.W)
  private val length  = AlarmUnit.RecordBytes.U(16.W)
  private val bytes =
    Cat(1.U(16.W), record.bits, 0.U(16.W), length, address, node, event.sequence(7, 0), 0.U(8.W))
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

  /** Bytes of an alarm record, and of the datagram around it. */
  val RecordBytes   = 8
  val DatagramBytes = 12 + RecordBytes
}
