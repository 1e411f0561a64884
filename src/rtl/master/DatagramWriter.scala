package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.protocol.{Command, ConfirmLayout, DatagramLayout, Layout, RecordAckLayout, SlaveStateLayout}
import flyframe.registers.AlarmRegisters

/** The datagrams of a frame, in their order (LM-01): `survey` asks all slaves for their status word and
  * counts them; `read` asks one for its state; `order` is silence or reset for one; `host` is what the
  * master's host sends; `acknowledge` tells a slave that its record is here; `confirm` tells all what the
  * server has.
  */
object DatagramKind extends ChiselEnum {
  val survey, read, order, host, acknowledge, confirm = Value
}

/** Writes a datagram byte by byte, one every second cycle: what it takes its bytes from may need a cycle.
  *
  * The index of a datagram for one slave is its `position`, so that its answer tells which one it was.
  */
class DatagramWriter extends Module {
  import DatagramWriter._

  /** Begins a datagram, while not `busy`; until that is over the other inputs must not change. */
  val start = IO(Input(Bool()))
  val kind  = IO(Input(DatagramKind()))
  val busy  = IO(Output(Bool()))

  /** Position of the slave in the table, bit 7: the alarm of two records, an order with a reset; of the first
    * slave that the frame reaches. The index of `survey` is the number of the frame.
    */
  val position = IO(Input(UInt(8.W)))
  val base     = IO(Input(UInt(8.W)))
  val frame    = IO(Input(UInt(4.W)))

  /** An order is for all slaves. */
  val orderAll = IO(Input(Bool()))

  /** The word of its data at `place`, and the byte of the host's datagram at `hostAddress`, as it stands at
    * the host's registers (HOST-05), a cycle later.
    */
  val place       = IO(Output(UInt(2.W)))
  val word        = IO(Input(UInt(16.W)))
  val hostAddress = IO(Output(UInt(4.W)))
  val hostData    = IO(Input(UInt(8.W)))

  val byte = IO(Output(Valid(UInt(8.W))))

  private val running = RegInit(false.B) // reset: no datagram
  private val settled = Reg(Bool())      // what the byte at `at` is made of has come
  private val at      = Reg(UInt(5.W))   // byte of the datagram
  private val left    = Reg(UInt(4.W))   // data bytes to come
  private val carry   = Reg(Bool())      // from the low byte of ADP into the high one
  private val high    = Reg(UInt(8.W))   // of the word whose low byte has been written: it may change
  private val moves   = Reg(Bool())      // the host's ADP is a position
  private val tail    = Reg(Bool())      // a byte of the working counter is written

  // What stands in the header, but for position and address of the host.
  private def header(command: Int, register: Int, length: Int, more: Boolean = true): Seq[Int] =
    Seq(command, 0, 0, 0, register & 0xff, register >> 8, length, if (more) 0x80 else 0)
  private val headers = Map(
    DatagramKind.survey      -> header(Command.Brd, AlarmRegisters.State, SlaveStateLayout.Status.bytes),
    DatagramKind.read        -> header(Command.Aprd, AlarmRegisters.State, SlaveStateLayout.bytes),
    DatagramKind.order       -> header(Command.Apwr, AlarmRegisters.Command, 1),
    DatagramKind.host        -> header(0, 0, 0),
    DatagramKind.acknowledge -> header(Command.Apwr, AlarmRegisters.Acknowledge, RecordAckLayout.bytes),
    DatagramKind.confirm     -> header(Command.Bwr, AlarmRegisters.Confirm, ConfirmLayout.bytes, more = false)
  )
  private val table = VecInit(
    DatagramKind.all.flatMap(headers).map(_.U(8.W)).padTo(64, 0.U(8.W))
  )
  private val isHost = kind === DatagramKind.host
  private val toAll = kind === DatagramKind.survey || kind === DatagramKind.confirm ||
    kind === DatagramKind.order && orderAll
  private val isLow  = at === DatagramLayout.Adp.offset.U
  private val toward = position(6, 0)

  // ADP is the first slave of the frame minus the position, or what the host says, from that slave on.
  private val (term, first) = (
    Mux(isHost, hostData, Mux(toAll, 0.U, Mux(isLow, ~toward.pad(8), 255.U))),
    Mux(isLow && Mux(isHost, moves, !toAll), base, 0.U)
  )
  private val sum = term +& first + Mux(isLow, !isHost && !toAll, carry).asUInt

  private val inHeader                                             = at < DatagramLayout.bytes.U
  private val inTail                                               = !inHeader && left === 0.U
  private def on(field: DatagramLayout.type => Layout.Field): Bool = at === field(DatagramLayout).offset.U
  private val ofHost = Mux(on(_.Length) && hostData > MostBytes.U, MostBytes.U, hostData)
  private val index = Mux(
    kind === DatagramKind.survey,
    frame,
    Mux(kind === DatagramKind.confirm, 0.U, position)
  )
  private val ofOwn = Mux(
    at(3),
    0.U,
    table(Cat(kind.asUInt, at(2, 0))) | Mux(on(_.Index), index, 0.U)
  ) ^ Mux(on(_.Command) && kind === DatagramKind.order && orderAll, (Command.Apwr ^ Command.Bwr).U, 0.U)
  private val isAdp = at(3, 1) === (DatagramLayout.Adp.offset / 2).U
  private val asTold =
    isHost && (at === 0.U || at(3, 1) === (DatagramLayout.Ado.offset / 2).U || on(_.Length))
  private val ofWord = Mux(at(0), high, word(7, 0))
  place := (at - DatagramLayout.bytes.U)(2, 1)
  hostAddress := MuxCase(
    at(3, 0) - 2.U, // the data
    Seq(
      (at === DatagramLayout.Command.offset.U) -> 0.U,
      (at === DatagramLayout.Length.offset.U)  -> 1.U,
      (at < DatagramLayout.Length.offset.U)    -> (at(3, 0) + 2.U) // the address
    )
  )
  busy       := running
  byte.valid := running && settled
  byte.bits := Mux(
    inHeader,
    Mux(isAdp, sum(7, 0), Mux(asTold, ofHost, ofOwn)),
    Mux(inTail, 0.U, Mux(isHost, hostData, ofWord))
  )

  settled := running && !settled
  when(byte.valid) {
    at := at + 1.U
    when(!at(0)) { high := word(15, 8) }
    when(on(_.Command)) { moves := hostData(7, 2) === 0.U && hostData =/= 0.U }
    when(isLow) { carry := sum(8) }
    when(on(_.Length)) { left := byte.bits }.elsewhen(!inHeader) { left := left - 1.U }
    when(inTail) {
      left := 0.U
      tail := true.B
      when(tail) { running := false.B }
    }
  }
  when(start) {
    running := true.B
    settled := false.B
    at      := 0.U
    tail    := false.B
  }
}

object DatagramWriter {

  /** Data bytes of the host's datagram, at most. */
  val MostBytes = 8
}
