package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.ram.DualPortRam

/** Takes silence and reset to the slaves that had something to silence or to reset when it was asked for, and
  * to nobody else (LM-07): an alarm that comes later is never silenced by an order that was given before.
  *
  * @param maxSlaves
  *   places in the table
  */
class OrderSender(maxSlaves: Int) extends Module {
  import OrderSender._
  private val bits = log2Ceil(maxSlaves)

  /** Pulses: what people want. */
  val silence    = IO(Input(Bool()))
  val resetAlarm = IO(Input(Bool()))

  /** It is to be noted for whom, before the table changes. That begins with `notes`; while `noting` the
    * status words at `readAt` are read; a cycle later it is there whether the slave sounds, and whether it
    * has smoke.
    */
  val due    = IO(Output(Bool()))
  val notes  = IO(Input(Bool()))
  val noting = IO(Output(Bool()))
  val readAt = IO(Output(UInt(bits.W)))
  val sounds = IO(Input(Bool()))
  val smoke  = IO(Input(Bool()))

  /** A cycle is over; true: with an answer. So long after it was asked for nothing of it counts any more;
    * some of it may not have arrived.
    */
  val over    = IO(Flipped(Valid(Bool())))
  val expires = IO(Output(Bool()))
  val givenUp = IO(Output(Bool()))

  /** More slaves answer than the table has places for: the order goes to all. */
  val crowded = IO(Input(Bool()))

  /** Positions may be those of others: what has not arrived is given up. */
  val forget = IO(Input(Bool()))

  /** While a frame is composed: `position` is to get `order`, bits of `alarm_command`, or, when neither that
    * nor `busy`, no more in this frame. It is `taken`.
    */
  val begin    = IO(Input(Bool()))
  val asks     = IO(Input(Bool()))
  val offers   = IO(Output(Bool()))
  val taken    = IO(Input(Bool()))
  val position = IO(Output(UInt(bits.W)))
  val mine     = IO(Input(Bool()))
  val order    = IO(Output(UInt(2.W)))
  val toAll    = IO(Output(Bool()))
  val busy     = IO(Output(Bool()))

  /** The order has been at the slave `doneAt`. */
  val done   = IO(Input(Bool()))
  val doneAt = IO(Input(UInt(bits.W)))

  private val wanted  = RegInit(0.U(2.W))       // bits of `alarm_command`, to be noted; reset: nothing
  private val now     = Reg(UInt(2.W))          // bits that are being noted
  private val sweeps  = RegInit(false.B)        // reset: nothing is being noted
  private val writes  = RegNext(sweeps, false.B)
  private val pending = RegInit(false.B)        // what is noted counts; reset: nothing is
  private val age     = RegInit(0.U(AgeBits.W)) // cycles since somebody asked; reset: 0
  private val broad   = RegInit(0.U(2.W))       // bits for all; reset: none
  private val passes  = Reg(Bool())             // they are in a frame of this cycle
  private val found   = Reg(Bool())             // somebody, on the way through all
  private val at      = RegInit(0.U(bits.W))    // slave at hand; reset: the first one
  private val settled = Reg(Bool())             // the memory shows what is noted for it
  private val sent  = Reg(UInt(log2Ceil(Most + 1).W)) // in this frame
  private val ended = Reg(Bool())                     // no more in this frame

  private val ram   = DualPortRam(maxSlaves max 128, 2)(clock) // less would be no block
  private val noted = ram.io.readData
  private val isOne = noted =/= 0.U
  expires             := over.valid && age.andR
  ram.io.readAddress  := at
  ram.io.write        := writes || done
  ram.io.writeAddress := Mux(writes, RegNext(at), doneAt)
  ram.io.writeData    := Mux(writes, Mux(pending, noted, 0.U) | now & Cat(smoke, sounds), 0.U)
  due                 := wanted.orR
  noting              := sweeps || writes
  readAt              := at
  position            := at
  toAll               := broad.orR
  order               := Mux(toAll, broad, noted)
  offers              := asks && !ended && (toAll || settled && isOne && mine)
  busy                := asks && !ended && !offers

  when(notes) {
    wanted := 0.U
    now    := wanted
    at     := 0.U
    when(crowded) {
      broad  := wanted
      passes := false.B
    }.otherwise { sweeps := true.B }
  }
  when(sweeps) {
    at := at + 1.U
    when(at.andR) { sweeps := false.B }
  }
  when(writes && !sweeps) {
    pending := true.B
    found   := false.B
  }
  when(silence) { wanted := wanted | AlarmCommand.Silence.U }
  when(resetAlarm) { wanted := wanted | AlarmCommand.Restart.U }

  settled := asks && !ended
  when(taken && toAll) {
    ended  := true.B
    passes := true.B
  }.elsewhen(busy && settled || taken) {
    at      := at + 1.U
    settled := false.B
    found   := found || isOne
    when(taken) { sent := sent + 1.U }
    when(taken && sent === (Most - 1).U) { ended := true.B }
    when(at.andR) {
      ended   := true.B
      pending := found || isOne
      found   := false.B
    }
  }
  when(begin) {
    sent  := 0.U
    ended := !pending && !toAll
  }
  when(over.valid) {
    age    := age + 1.U
    passes := false.B
    when(over.bits && passes) { broad := 0.U }
  }
  when(silence || resetAlarm) { age := 0.U }
  givenUp := (forget || expires) && (pending || toAll)
  when(forget || expires) {
    pending := false.B
    broad   := 0.U
  }
}

/** The bits of `alarm_command`. */
private object AlarmCommand {
  val Silence = 1
  val Restart = 2
}

object OrderSender {

  /** Orders of the master in a frame. */
  private val Most = 2

  /** An order is given up after 1024 cycles. */
  private val AgeBits = 10
}
