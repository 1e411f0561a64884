package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.ram.DualPortRam
import flyframe.registers.RingRegisters

/** Counts what happens in relay mode, in the order of [[flyframe.registers.RingRegisters.RelayCounterNames]],
  * in a block RAM with the words of the registers. What comes while others are being counted waits.
  */
class RelayCounts extends Module {
  import RelayCounts._

  /** Something has happened. */
  val events = IO(Input(Vec(RelayCounter.Count, Bool())))

  /** This word of the registers is there in the next cycle; read by the host while `reads`. */
  val address = IO(Input(UInt(4.W)))
  val reads   = IO(Input(Bool()))
  val data    = IO(Output(UInt(32.W)))

  private val ram = DualPortRam(Words, 32)(clock)

  // Reset: all become 0, a word a cycle.
  private val clearing = RegInit(0.U((log2Ceil(Registers) + 1).W))
  private val isClear  = clearing(log2Ceil(Registers))
  when(!isClear) { clearing := clearing + 1.U }

  // How many of each kind wait to be counted. Reset: none.
  private val waiting = places.indices.map { i =>
    val count = RegInit(0.U(waitingBits(i).W))
    count.suggestName(s"waiting_${RingRegisters.RelayCounterNames(i).stripPrefix("ring_")}")
  }
  private val next    = PriorityEncoderOH(waiting.map(_ =/= 0.U))
  private val any     = waiting.map(_ =/= 0.U).reduce(_ || _)
  private val reading = RegInit(false.B)         // a word is there; reset: none
  private val adding  = RegNext(reading, false.B)
  private val starts  = any && isClear && !reads && !reading && !adding
  private val place   = Mux1H(next, places.map { case (word, lane) => word.U(4.W) ## lane.U(3.W) })
  private val at      = RegEnable(place, starts) // lane 4: all 32 bits
  reading := starts
  for ((count, i) <- waiting.zipWithIndex) count := count + events(i) - (starts && next(i))

  private val old   = RegEnable(ram.io.readData, reading)
  private val isAll = at(2)
  private val one   = Lanes.bytes(old, 4)(at(1, 0))
  private val sum   = Mux(isAll, old, one) + !(!isAll && one.andR)
  private val merged = Cat((0 until 4).reverse.map { i =>
    Mux(at(1, 0) === i.U, sum(7, 0), Lanes.byte(old, i))
  })
  ram.io.readAddress  := Mux(reads, address, place(6, 3))
  ram.io.write        := adding || !isClear
  ram.io.writeAddress := Mux(isClear, at(6, 3), clearing)
  ram.io.writeData    := Mux(isClear, Mux(isAll, sum, merged), 0.U)
  data                := ram.io.readData
}

object RelayCounts {
  import RelayCounter._

  /** Words of the registers up to 0x3F, and of a memory at least, so that it goes to block RAM. */
  private val Registers = 16
  private val Words     = 64

  /** Word and lane of each counter; lane 4 is that of a whole word. */
  private val places: Seq[(Int, Int)] = RingRegisters.RelayCounterNames.map { name =>
    val r = RingRegisters.relay.find(_.name == name).get
    (r.address / 4, if (r.bytes == 4) 4 else r.address % 4)
  }

  /** Of own frames all may be done at once; others come twice at most until they are counted. */
  private def waitingBits(counter: Int): Int =
    if (Seq(Repeated, Failed, Confirmed).contains(counter)) 5 else 2
}
