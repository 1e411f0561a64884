package flyframe.mii

import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Simulation
import flyframe.model.{Fcs, Symbol, WireFrame}

/** The receiver alone: what it makes of a frame (B-01 to B-03) and what it counts (ERR-02). */
class MiiReceiverSpec extends AnyFlatSpec with ChiselScalatestTester {

  /** The nibbles that left, the flags at the end, and how often each event came. */
  private case class Seen(
      nibbles: Vector[Int] = Vector.empty,
      payload: Int = 0,
      bad: Boolean = false,
      odd: Boolean = false,
      ends: Int = 0,
      invalid: Int = 0,
      forwarded: Int = 0,
      rxEr: Int = 0,
      good: Int = 0
  ) {
    def counts: (Int, Int, Int, Int) = (invalid, forwarded, rxEr, good)
  }

  /** What disturbs the receiver besides its symbols, by the index of the symbol. */
  private sealed trait Trouble
  private case object Underrun extends Trouble
  private case object Overflow extends Trouble
  private case object Cut      extends Trouble

  /** A slot is two cycles, so that what must come once per slot is seen to. */
  private def receive(symbols: Seq[Symbol], trouble: Map[Int, Trouble] = Map.empty): Seen = {
    var seen = Seen()
    test(new MiiReceiver).withAnnotations(Simulation.annotations(this, "receiver")) { dut =>
      dut.clock.setTimeout(0)
      val all = symbols.map(Option(_)) ++ Seq.fill(4)(None)
      for ((symbol, i) <- all.zipWithIndex) {
        val now = trouble.get(i)
        dut.symbols.available.poke(!now.contains(Underrun))
        dut.symbols.settled.poke(true)
        dut.symbols.overflow.poke(now.contains(Overflow))
        dut.symbols.symbol.dv.poke(symbol.isDefined)
        dut.symbols.symbol.er.poke(symbol.exists(_.error))
        dut.symbols.symbol.data.poke(symbol.fold(0)(_.nibble))
        for (tick <- Seq(false, true)) {
          dut.tick.poke(tick)
          dut.cut.poke(now.contains(Cut) && !tick)
          def count(event: chisel3.Bool) = if (event.peekBoolean()) 1 else 0
          seen = seen.copy(
            invalid = seen.invalid + count(dut.events.invalidFrame),
            forwarded = seen.forwarded + count(dut.events.forwardedError),
            rxEr = seen.rxEr + count(dut.events.rxEr),
            good = seen.good + count(dut.events.goodFrame)
          )
          if (tick && dut.out.valid.peekBoolean()) {
            assert(seen.ends == 0 && count(dut.out.end) == 0, "nothing comes behind the end")
            seen = seen.copy(
              nibbles = seen.nibbles :+ dut.out.data.peekInt().toInt,
              payload = seen.payload + count(dut.out.payload)
            )
          } else if (tick && dut.out.end.peekBoolean()) {
            val payload = seen.nibbles.takeRight(seen.payload)
            assert(dut.out.payload.peekBoolean() == seen.nibbles.contains(0xd), "behind the SFD")
            if (payload.nonEmpty) {
              val bytes = payload.grouped(2).collect { case Seq(low, high) => low | high << 4 }.toSeq
              assert(dut.out.crcGood.peekBoolean() == Fcs.good(bytes), "the FCS up to here")
            }
            seen = seen.copy(
              bad = dut.out.bad.peekBoolean(),
              odd = payload.nonEmpty && dut.out.odd.peekBoolean(),
              ends = seen.ends + 1
            )
          } else assert(!tick || seen.nibbles.isEmpty || seen.ends == 1, "no hole in a frame")
          dut.clock.step()
        }
      }
      assert(dut.idle.peekBoolean())
    }
    assert(seen.ends == 1, "a frame has one end")
    seen
  }
  private def nibbles(frame: Seq[Symbol]) = frame.map(_.nibble)

  private val bytes           = (0 until 60).map(i => (i * 37 + 1) & 0xff)
  private val good            = WireFrame.withFcs(bytes).symbols
  private val wrong           = WireFrame.ofBytes(bytes ++ Fcs.of(bytes).map(_ ^ 1)).symbols
  private val start           = 16 // preamble and SFD
  private val error           = (s: Symbol) => s.copy(error = true)
  private def hit(at: Int*)   = at.foldLeft(good)((f, i) => f.updated(i, error(f(i))))
  private def invalid         = (1, 0, 0, 0)
  private def invalidWithRxEr = (1, 0, 1, 0)

  "B-01, B-05: a good frame" should "come out as it came, whatever its preamble" in {
    for (preamble <- Seq(0, 1, 15, 40)) {
      val frame = WireFrame.withFcs(bytes, preamble).symbols
      val seen  = receive(frame)
      assert(seen.nibbles == nibbles(frame) && seen.payload == 128)
      assert(!seen.bad && !seen.odd && seen.counts == ((0, 0, 0, 1)))
    }
  }
  "B-03, OP-10: a dribble nibble" should "leave the frame good, and be told as odd" in {
    val seen = receive(good :+ Symbol(9))
    assert(!seen.bad && seen.odd && seen.counts == ((0, 0, 0, 1)))
  }
  "B-03, ERR-02: a wrong FCS" should "count as invalid" in {
    val seen = receive(wrong)
    assert(seen.bad && !seen.odd && seen.payload == 128 && seen.counts == invalid)
  }
  "B-03, ERR-08: a wrong FCS and one nibble too many" should "count as forwarded" in {
    val seen = receive(wrong :+ Symbol(0))
    assert(seen.bad && seen.odd && seen.payload == 129 && seen.counts == ((0, 1, 0, 0)))
  }
  "B-03, FP-11: a frame of 63 bytes with a good FCS" should "be bad but not be counted" in {
    for (dribble <- Seq(Nil, Seq(Symbol(0)))) {
      val seen = receive(WireFrame.withFcs(bytes.take(59)).symbols ++ dribble)
      assert(seen.bad && seen.counts == ((0, 0, 0, 0)))
    }
  }
  "B-01: a frame that ends in the preamble" should "be invalid" in {
    for (length <- Seq(1, 2, 15)) {
      val seen = receive(good.take(length))
      assert(seen.bad && seen.payload == 0 && seen.nibbles.size == length && seen.counts == invalid)
    }
  }
  "B-03: a frame that ends with the SFD" should "be invalid" in {
    val seen = receive(good.take(start))
    assert(
      seen.bad && seen.payload == 0 && seen.nibbles == nibbles(good.take(start)) && seen.counts == invalid
    )
  }
  "B-02: RX_ER" should "cut the frame off before the faulty nibble and count every symbol" in {
    for (at <- Seq(1, start - 1, start, start + 1, start + 60, start + 127)) {
      val seen = receive(hit(at))
      assert(
        seen.bad && seen.nibbles == nibbles(good.take(at)) && seen.counts == invalidWithRxEr,
        s"symbol $at"
      )
    }
    assert(receive(hit(30, 31, 90)).counts == ((1, 0, 3, 0)))
  }
  it should "leave one nibble if it comes with the first" in {
    val seen = receive(hit(0))
    assert(seen.bad && seen.nibbles == Seq(5) && seen.payload == 0 && seen.counts == invalidWithRxEr)
    for (first <- 0 to 0xf) { // whatever it is, it leaves as preamble
      val seen = receive(Symbol(first, error = true) +: good.tail)
      assert(seen.bad && seen.nibbles == Seq(5) && seen.counts == invalidWithRxEr)
    }
  }
  "B-01, B-02: a wrong preamble nibble" should "be no SFD" in {
    for (at <- Seq(0, 1, 7)) {
      val seen = receive(good.updated(at, Symbol(7)))
      assert(seen.bad && seen.nibbles == Seq.fill(at max 1)(5) && seen.payload == 0 && seen.counts == invalid)
    }
  }
  "B-01, B-02, FP-11: too long a preamble or payload" should "be cut off at 4,096 nibbles" in {
    val long = WireFrame.withFcs(bytes, preamble = 4096).symbols
    assert(receive(long).counts == ((0, 0, 0, 1)))
    assert(receive(WireFrame.withFcs(bytes, preamble = 4097).symbols).counts == invalid)
    val most = (0 until 2044).map(_ & 0xff)
    assert(receive(WireFrame.withFcs(most).symbols).counts == ((0, 0, 0, 1)))
    val seen = receive(WireFrame.withFcs(most :+ 1).symbols)
    assert(seen.bad && seen.payload == 4096 && seen.counts == invalid)
  }
  "B-02, B-30: overflow, underrun and link loss" should "cut the frame off" in {
    for (trouble <- Seq(Overflow, Underrun, Cut); at <- Seq(5, start + 40)) {
      val seen = receive(good, Map(at -> trouble))
      assert(seen.bad && seen.nibbles == nibbles(good.take(at)) && seen.counts == invalid, s"$trouble at $at")
    }
  }
  "PHY-03: a receiver" should "not start before the symbol is settled" in test(new MiiReceiver)
    .withAnnotations(Simulation.annotations(this, "receiver")) { dut =>
      dut.tick.poke(true)
      dut.symbols.available.poke(true)
      dut.symbols.symbol.dv.poke(true)
      dut.symbols.symbol.data.poke(5)
      for (_ <- 0 until 5) {
        dut.symbols.take.expect(false)
        dut.clock.step()
        dut.idle.expect(true)
      }
      dut.symbols.settled.poke(true)
      dut.symbols.take.expect(true)
      dut.clock.step()
      dut.idle.expect(false)
    }
}
