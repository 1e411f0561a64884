package flyframe.can

import chisel3._
import chisel3.util._
import flyframe.ram.DualPortRam

/** Work on one word of [[PortMemory]]: it is read, and, if `write`, those of its bytes that `bytes` names are
  * replaced by those of `data`, or counted up by one if `counts`, each for itself up to 255, or, if `wide`,
  * the first one with the others as its upper bytes; the result goes to `target`.
  */
class MemoryJob extends Bundle {
  val source = UInt(PortMemory.AddressBits.W)
  val target = UInt(PortMemory.AddressBits.W)
  val write  = Bool()
  val counts = Bool()
  val wide   = Bool()
  val bytes  = UInt(4.W)
  val data   = UInt(32.W)
}

/** The memory of a port in one block RAM: slots, filters, and what registers only keep. After a reset it is
  * cleared, a word a cycle.
  *
  * @param jobs
  *   how many have jobs, the most urgent first
  */
class PortMemory(jobs: Int) extends Module {
  import PortMemory._

  /** Reads that come before all others: a word of a slot. They never wait. */
  val load = IO(Input(Valid(UInt(6.W))))

  /** A job stays as it is until it is done, which is the cycle in which `word` is the one that was read. */
  val job  = IO(Input(Vec(jobs, Valid(new MemoryJob))))
  val done = IO(Output(UInt(jobs.W)))
  val word = IO(Output(UInt(32.W)))

  /** Reads that come behind them. */
  val order       = IO(Input(Valid(UInt(4.W)))) // the identifier word of this slot
  val orderReady  = IO(Output(Bool()))
  val filter      = IO(Input(Valid(UInt(6.W)))) // a word of the filters
  val filterReady = IO(Output(Bool()))

  /** The word that was read otherwise, in the next cycle. */
  val data = IO(Output(UInt(32.W)))

  private val ram      = DualPortRam(Words, 32)(clock)
  private val clearing = RegInit(0.U((AddressBits + 1).W)) // reset: from the first word on
  private val isClear  = clearing(AddressBits)
  when(!isClear) { clearing := clearing + 1.U }

  // A job is read in one cycle; in the next the bytes are replaced; in the third it is written, counted up.
  // No other is read meanwhile: it could be the same word.
  private val reads   = RegInit(0.U(jobs.W)) // the job whose word is there; reset: none
  private val writes  = RegNext(reads, 0.U)  // the job that is written; reset: none
  private val isBusy  = (reads | writes).orR
  private val chosen  = PriorityEncoderOH(VecInit(job.map(_.valid)).asUInt)
  private val asks    = isClear && !isBusy && job.map(_.valid).reduce(_ || _)
  private val anyJob  = asks && !load.valid
  private val reading = Mux1H(chosen, job.map(_.bits.source))
  private val atHand  = Mux1H(reads | writes, job.map(_.bits))
  reads := Fill(jobs, anyJob) & VecInit(chosen.asBools).asUInt
  done  := writes

  orderReady  := isClear && !load.valid && !anyJob
  filterReady := orderReady && !order.valid
  ram.io.readAddress := Mux(
    load.valid,
    Slots.U(2.W) ## load.bits,
    Mux(
      asks,
      reading,
      Mux(order.valid, Slots.U(2.W) ## order.bits ## 0.U(2.W), Filters.U(2.W) ## filter.bits)
    )
  )
  data := ram.io.readData

  private def bytes(of: Int => UInt) = Cat((0 until 4).reverse.map(of))
  private def byte(of: UInt, i: Int) = of(8 * i + 7, 8 * i)
  private val merged = RegNext(bytes { i => // nobody has a job while it is cleared: of 0
    Mux((atHand.bytes(i) && !atHand.counts) || !isClear, byte(atHand.data, i), byte(data, i))
  })
  private val ups    = RegNext(Fill(4, atHand.counts) & atHand.bytes)
  private val isWide = RegNext(atHand.counts && atHand.wide)
  private val isFull = (0 until 4).map(byte(merged, _).andR)
  private val adds = (0 until 4).map { i =>
    if (i == 0) ups(0) && (isWide || !isFull(0))
    else Mux(isWide, ups(0) && isFull.take(i).reduce(_ && _), ups(i) && !isFull(i))
  }
  private val counted = bytes(i => byte(merged, i) + adds(i))
  word                := merged
  ram.io.write        := !isClear || (writes.orR && atHand.write)
  ram.io.writeAddress := Mux(isClear, atHand.target, clearing)
  ram.io.writeData    := counted
}

object PortMemory {
  val AddressBits = 8
  val Words       = 1 << AddressBits

  // What the upper two bits of an address select.
  val Slots     = 0
  val Filters   = 1
  val Waiting   = 2 // the two words of a filter that is being written
  val Registers = 3 // by the offset of a register from the start of its port

  /** Eight words of counters, see [[WordCounters]]. */
  val Counters = 2 * 64 + 8

  /** Where the register with this offset lies. */
  def register(offset: Int): UInt = (Registers * 64 + offset / 4).U(AddressBits.W)
}
