package flyframe.can

import chisel3._
import chisel3.util._

/** A counter in a [[PortMemory]].
  *
  * @param word
  *   in which it is
  * @param lane
  *   a byte of it, which stops at 255, or none: all 32 bits
  * @param waiting
  *   bits of how many events may wait to be counted
  */
final case class WordCounter(word: Int, lane: Option[Int], waiting: Int)

/** Counts events in words of a [[PortMemory]]. It looks at one counter a cycle for what waits.
  *
  * @param counters
  *   bytes of words 0 to 3, and all 32 bits of words 4 to 7
  */
class WordCounters(counters: Seq[WordCounter]) extends Module {
  import WordCounters._

  val events = IO(Input(Vec(counters.size, Bool())))

  /** Something waits to be counted: from the second cycle behind an event on, and a cycle longer than need
    * be.
    */
  val waits = IO(Output(Bool()))

  /** To [[PortMemory]]. */
  val job  = IO(Output(Valid(new MemoryJob)))
  val done = IO(Input(Bool()))

  // The counter that is looked at: a byte of the first words, or one of the last words. While it counts it
  // stays. Reset: the first one; nothing waits.
  private val at       = RegInit(0.U(IndexBits.W))
  private val isActive = RegInit(false.B)
  private val indices  = counters.map(indexOf)
  for (c <- counters)
    require(
      if (c.lane.nonEmpty) 0 to 3 contains c.word else 4 to 7 contains c.word,
      s"A counter of ${c.lane.fold("32 bits")(_ => "a byte")} must not be in word ${c.word}."
    )
  require(indices.distinct.size == indices.size, s"Counters have the same place: $indices.")
  private val happened = RegNext(events, 0.U.asTypeOf(events)) // as they come late in their cycle
  private val waiting = counters.zip(happened).zip(indices).map { case ((c, event), index) =>
    val count = RegInit(0.U(c.waiting.W))
    val left  = Mux(isActive && done && at === index.U, count - 1.U, count)
    // A counter of one bit is for events that never come twice meanwhile.
    count := (if (c.waiting == 1) left | event else left + event)
    count.suggestName(s"waiting_${c.word}_${c.lane.fold("all")(_.toString)}")
  }
  private val isMine = Mux1H(
    waiting.zip(indices).map { case (count, index) => (at === index.U) -> count.orR }
  )
  waits := RegNext(happened.asUInt.orR || waiting.map(_.orR).reduce(_ || _), false.B) // reset: nothing does
  when(isActive) { isActive := !done }
    .elsewhen(isMine) { isActive := true.B }
    .otherwise { at := at + 1.U }

  private val isWide = at(IndexBits - 1)
  job.valid       := isActive
  job.bits.source := PortMemory.Counters.U(PortMemory.AddressBits.W) | Mux(isWide, 4.U | at(1, 0), at(3, 2))
  job.bits.target := job.bits.source
  job.bits.write  := true.B
  job.bits.counts := true.B
  job.bits.wide   := isWide
  job.bits.bytes  := UIntToOH(at(1, 0)) | isWide
  job.bits.data   := 0.U
}

object WordCounters {
  private val IndexBits = 5

  private def indexOf(counter: WordCounter): Int = counter.lane match {
    case Some(lane) => 4 * counter.word + lane
    case None       => (1 << IndexBits - 1) + counter.word - 4
  }
}
