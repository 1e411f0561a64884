package flyframe.memory

import chisel3._
import chisel3.util._
import flyframe.params.EscParams
import flyframe.registers.{Access, FieldRecord, KeptRead, RegisterMap}

/** A unit alone, with its bus at the pins: the test writes and reads registers, and is all other units.
  *
  * @param make
  *   makes the unit
  */
class UnitUnderTest[U <: RegisterUnit](p: EscParams, make: => U) extends Module with RegisterPort {
  private val registers           = RegisterMap(p)
  val value: FieldRecord          = IO(Input(FieldRecord.value(registers)))
  val set: FieldRecord            = IO(Output(FieldRecord.set(registers)))
  val status: FieldRecord         = IO(Output(FieldRecord.status(registers)))
  val event: FieldRecord          = IO(Output(FieldRecord.event(registers)))
  val guard: FieldRecord          = IO(Output(FieldRecord.guard(registers)))
  val host: HostPort              = IO(Input(new HostPort(p.lanes)))
  val registerWrite               = IO(Input(Valid(new RegisterWrite(p.lanes, p.hasBitWrites))))
  val registerWriteByHost: Bool   = IO(Input(Bool()))
  val registersBusy: Bool         = IO(Input(Bool()))
  val commitStarts: Bool          = IO(Input(Bool()))
  val clearing: Bool              = IO(Input(Bool()))
  val unitWrite                   = IO(Decoupled(new UnitWrite))
  val unitRead: DecoupledIO[UInt] = IO(Decoupled(UInt(12.W)))
  val unitData: Valid[UInt]       = IO(Input(Valid(UInt(8.W))))

  override val kept: Map[Int, KeptRead] = KeptRead
    .pages(registers)
    .map(_ -> IO(Flipped(new KeptRead(12 - log2Ceil(p.lanes), p.lanes))))
    .toMap

  /** What frames do. */
  val begins = IO(Input(Bool()))
  val good   = IO(Input(Bool()))
  val bad    = IO(Input(Bool()))
  val busy   = IO(Input(Bool()))
  val error  = IO(Input(Bool()))
  val reads  = IO(Input(FieldRecord.pulses(registers.filter(_.ecat == Access.ReadAcknowledge).map(_.name))))

  /** What other units show in status fields. */
  val others = IO(Input(FieldRecord.status(registers)))
  val irq    = IO(Output(Bool()))

  status := others
  for (record <- Seq(set, event, guard)) record := 0.U.asTypeOf(record)
  for (port   <- kept.values) {
    port.data       := 0.U
    port.host.ready := true.B
  }
  protected val unit: U = make
  private val bus =
    new RegisterBus(p, this, registers, FrameEvents(begins, good, bad, busy, error, reads), host.ack)
  unit.connect(bus)
  irq := bus.interruptLevel.getOrElse(false.B)
}
