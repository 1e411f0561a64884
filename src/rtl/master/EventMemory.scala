package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.protocol.{EventLayout, MasterEvent}
import flyframe.ram.DualPortRam

/** Keeps events until the server has them (REP-02, REP-06): each as it came, with the time of the master. */
class EventMemory extends Module {
  import EventMemory._

  /** Events, see [[MasterEvent]]; those of the first source come first. */
  val event = IO(Vec(2, Flipped(Decoupled(UInt(16.W)))))

  /** Time of the master in us, in words of 16 bits, the highest first; it must not change while `stamps`. */
  val timeAddress = IO(Output(UInt(2.W)))
  val now         = IO(Input(UInt(16.W)))
  val stamps      = IO(Output(Bool()))

  /** Number of the oldest event that is kept, how many are, and the number that the next one gets, or the one
    * on its way has.
    */
  val first = IO(Output(UInt(32.W)))
  val count = IO(Output(UInt(CountBits.W)))
  val next  = IO(Output(UInt(16.W)))

  /** The server has so many of the oldest ones, at most `count`. */
  val remove = IO(Flipped(Valid(UInt(CountBits.W))))

  /** One event more is kept. */
  val stored = IO(Output(Bool()))

  /** Records of slaves are welcome; changes of states are; the server should have taken more. */
  val roomForRecords = IO(Output(Bool()))
  val roomForStates  = IO(Output(Bool()))
  val full           = IO(Output(Bool()))

  /** Byte of an event, numbered from the oldest one on; it comes a cycle later. */
  val readEvent = IO(Input(UInt(5.W)))
  val readByte  = IO(Input(UInt(5.W)))
  val readData  = IO(Output(UInt(8.W)))

  private object State extends ChiselEnum { val idle, event, stamp = Value }
  private val state  = RegInit(State.idle)       // reset: nothing to write
  private val word   = Reg(UInt(3.W))
  private val chosen = Reg(Bool())               // it comes from the second source
  private val number = RegInit(0.U(32.W))        // of the oldest; reset: none has been
  private val kept   = RegInit(0.U(CountBits.W)) // reset: none
  private val many   = RegInit(false.B)          // reset: none kept
  first          := number
  count          := kept
  next           := number + kept
  roomForRecords := kept < ForRecords.U
  roomForStates  := kept < ForStates.U
  full           := many
  when(kept >= FullFrom.U) { many := true.B }
  when(kept < FullUntil.U) { many := false.B }

  stored := state === State.stamp && word === 3.U
  private val removed = Mux(remove.valid, remove.bits, 0.U)
  number := number + removed
  kept   := kept - removed + stored

  // Two memories: events as they came, and their times.
  for ((source, i) <- event.zipWithIndex) source.ready := state === State.event && chosen === i.U
  private val came  = Mux(chosen, event(1).bits, event(0).bits)
  private val fires = state === State.event && Mux(chosen, event(1).valid, event(0).valid)
  private val place = next(PlaceBits - 1, 0)
  private val read  = number(PlaceBits - 1, 0) + readEvent
  private def memory(wordBits: Int, write: Bool, data: UInt): UInt = {
    val ram = DualPortRam(1 << (PlaceBits + wordBits), 16)(clock)
    ram.io.write        := write
    ram.io.writeAddress := Cat(place, word(wordBits - 1, 0))
    ram.io.writeData    := data
    ram.io.readAddress  := Cat(read, readByte(wordBits, 1))
    ram.io.readData
  }
  stamps      := state === State.stamp
  timeAddress := word(1, 0)
  private val content = memory(3, fires, came)
  private val times   = memory(2, stamps, now)
  private val both    = Mux(RegNext(readByte(4)), times, content)
  readData := Mux(RegNext(readByte(0)), both(7, 0), both(15, 8))
  require(EventLayout.MasterTime.offset == 16 && MasterEvent.Words == 8, "what comes of an event has 8 words")

  switch(state) {
    is(State.idle) {
      word   := 0.U
      chosen := !event(0).valid
      when((event(0).valid || event(1).valid) && !kept(PlaceBits)) { state := State.event }
    }
    is(State.event) {
      when(fires) {
        word := word + 1.U
        when(word.andR) { state := State.stamp }
      }
    }
    is(State.stamp) {
      word := word + 1.U
      when(stored) { state := State.idle }
    }
  }
}

object EventMemory {

  /** Places, and bits of how many are taken. */
  private val PlaceBits = 7
  val CountBits         = PlaceBits + 1

  /** Fewer are kept than this: there is room for records of slaves, for changes of states. */
  val ForRecords = 120
  val ForStates  = 64

  /** From so many on it is full, until there are fewer than so many. */
  val FullFrom  = 64
  val FullUntil = 32
}
