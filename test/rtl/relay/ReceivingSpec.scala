package flyframe.relay

import chisel3._
import chisel3.util.Valid
import chiseltest._
import flyframe.Simulation
import flyframe.params.CanParams
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable
import scala.util.Random

/** [[Receiving]] with names that mean nothing in C++. */
class ReceivingUnderTest(p: CanParams) extends Module {
  private val dut = Module(new Receiving(p))
  val on          = IO(Input(Bool()))
  val address     = IO(Input(UInt(7.W)))
  val now         = IO(Input(UInt(16.W)))
  val starts      = IO(Input(Vec(2, Bool())))
  val identified  = IO(Input(Vec(2, Bool())))
  val received    = IO(Input(Vec(2, Bool())))
  val read        = IO(Output(Valid(UInt(5.W))))
  val from        = IO(Output(UInt(1.W)))
  val granted     = IO(Input(Bool()))
  val data        = IO(Input(UInt(8.W)))
  val home        = IO(Output(Vec(2, Valid(new HomeFrame))))
  val frame       = IO(Output(Valid(new WholeFrame)))
  val done        = IO(Input(Bool()))
  val takes       = IO(Input(Bool()))
  val search      = IO(Output(Bool()))
  val identifier  = IO(Output(UInt(32.W)))
  val found       = IO(Input(Bool()))
  val isMatch     = IO(Input(Bool()))
  val entry       = IO(Input(UInt(dut.entry.getWidth.W)))
  val store       = IO(Output(Valid(UInt(2.W))))
  val stored      = IO(Output(UInt(32.W)))
  val accept      = IO(Output(Bool()))
  val second      = IO(Output(UInt(32.W)))
  dut.on         := on
  dut.address    := address
  dut.time       := now
  dut.starts     := starts
  dut.identified := identified
  dut.received   := received
  dut.granted    := granted
  dut.data       := data
  dut.done       := done
  dut.takes      := takes
  dut.found      := found
  dut.matches    := isMatch
  dut.entry      := entry
  read           := dut.read
  from           := dut.from
  home           := dut.home
  frame          := dut.frame
  search         := dut.search
  identifier     := dut.identifier
  store          := dut.store
  stored         := dut.stored
  accept         := dut.accept
  second         := dut.second
}

class ReceivingSpec extends AnyFlatSpec {
  private val p   = CanParams()
  private val Own = 23
  private val Bit = 25

  /** A frame, with its bytes as [[FrameStore]] has them, and what the parts around are to say of it. */
  private case class Came(header: LinkHeader, word: Long, dlc: Int, data: Seq[Int], stamp: Int) {
    val bytes: Seq[Int] = {
      val first = header.kind << 30 | header.direction << 29 | header.source << 22 | header.sequence << 8 |
        header.hops
      def four(n: Long) = Seq(24, 16, 8, 0).map(i => (n >> i & 0xff).toInt)
      four(first) ++ four(word) ++ Seq(dlc) ++ data
    }
    val isReserved: Boolean = (word >> 29 & 1) == 1 || ((word >> 31) == 0 && (word >> 11 & 0x3ffff) != 0)
    val isMatch: Boolean    = word            % 3 > 0 && !isReserved
    val entry: Int          = (word           % p.filters).toInt
    val isTaken: Boolean    = header.sequence % 4 > 0

    /** Words of the FIFO. */
    def words: (Long, Long, Long, Long) = {
      val kept = if ((word >> 30 & 1) == 1) Nil else data.take(dlc min 8)
      def four(at: Int) =
        kept.slice(at, at + 4).zipWithIndex.map { case (b, i) => b.toLong << 8 * i }.sum
      (word, stamp.toLong << 16 | entry.toLong << 8 | dlc, four(0), four(4))
    }
  }

  private def frame(random: Random, time: Int): Came = {
    val extended = random.nextBoolean()
    val remote   = random.nextInt(5) == 0
    val id       = if (extended) random.nextInt(1 << 29) else random.nextInt(1 << 11)
    // The upper half of an extended one's flags is reserved now and then.
    val odd  = if (random.nextInt(10) == 0) 1L << 29 else 0L
    val flag = (if (extended) 1L << 31 else 0L) | (if (remote) 1L << 30 else 0L)
    val word = if (extended) flag | id & 0x1fffffffL else flag | odd | id
    val header = LinkHeader(
      LinkKind.Data,
      random.nextInt(2),
      if (random.nextInt(5) == 0) Own else 1 + random.nextInt(20),
      random.nextInt(1 << 14),
      random.nextInt(255)
    )
    Came(header, word, random.nextInt(9), Seq.fill(8)(random.nextInt(256)), time)
  }

  "FR-57, FR-59, RB-06: frames of both ports" should
    "go home, or to sources, filter and FIFO, once and whole, also while a filter is looked for" in
    RawTester.test(new ReceivingUnderTest(p), Simulation.annotations(this, "receiving")) { dut =>
      dut.clock.setTimeout(0)
      val random  = new Random(3)
      val stores  = Array.fill(2)(Seq.fill(17)(0))
      val waiting = Array.fill(2)(Option.empty[Came]) // whole, and not yet told of
      val comes   = Array.fill(2)(Option.empty[Came])
      val at      = Array.fill(2)(0)                  // cycles until something happens to what comes
      val step    = Array.fill(2)(0)
      val words   = mutable.Map.empty[Int, Long]
      var search  = Option.empty[(Long, Int)]         // the identifier, and cycles
      var (homes, stored, dropped, given) = (0, 0, 0, 0)
      var asked                           = Option.empty[Int]
      dut.on.poke(true)
      dut.address.poke(Own)
      for (cycle <- 0 until 300000) {
        val now = cycle / 64 & 0xffff
        dut.now.poke(now)
        for (q <- 0 to 1) {
          for (pulse <- Seq(dut.starts(q), dut.identified(q), dut.received(q))) pulse.poke(false)
          if (at(q) > 0) at(q) -= 1
          else
            step(q) match {
              case 0 =>
                comes(q) = Some(frame(random, now))
                dut.starts(q).poke(true)
                step(q) = 1
                at(q) = 9 * Bit
              case 1 => // its bytes take the place of the last one's
                assert(waiting(q).isEmpty, s"cycle $cycle: a frame is told of too late")
                step(q) = 2
                at(q) = 2 * Bit
              case 2 =>
                stores(q) = comes(q).get.bytes
                dut.identified(q).poke(true)
                step(q) = 3
                at(q) = 24 * Bit + random.nextInt(24 * Bit)
              case _ if random.nextInt(8) == 0 => // it breaks off
                step(q) = 0
                at(q) = 7 * Bit + random.nextInt(9)
              case _ =>
                dut.received(q).poke(true)
                waiting(q) = comes(q)
                step(q) = 0
                at(q) = if (random.nextBoolean()) 7 * Bit else 7 * Bit + random.nextInt(100)
            }
        }
        // The store gives bytes, the filter answers, the sources do.
        val isRead = dut.read.valid.peekBoolean() && random.nextInt(4) > 0
        val byte =
          if (isRead) stores(dut.from.peekInt().toInt)(dut.read.bits.peekInt().toInt) else 0
        dut.granted.poke(isRead)
        dut.found.poke(search.exists(_._2 == 0))
        for ((id, 0) <- search) {
          val it = Came(LinkHeader(0, 0, 1, 0, 0), id, 0, Nil, 0)
          dut.isMatch.poke(it.isMatch)
          dut.entry.poke(it.entry)
        }
        search = search.collect { case (id, left) if left > 0 => id -> (left - 1) }
        if (dut.search.peekBoolean()) {
          if (search.nonEmpty) given += 1
          search = Some(dut.identifier.peekInt().toLong -> random.nextInt(200))
        }
        val isAsked = dut.frame.valid.peekBoolean()
        if (!isAsked) asked = None
        else if (asked.isEmpty) asked = Some(random.nextInt(6))
        val answers = asked.contains(0)
        dut.done.poke(answers)
        for (n <- asked) asked = Some(n - 1)
        if (answers) {
          val q  = dut.frame.bits.receivedBy.peekInt().toInt
          val it = waiting(q).get
          dut.takes.poke(it.isTaken)
          dut.frame.bits.source.expect(it.header.source)
          dut.frame.bits.sequence.expect(it.header.sequence)
          dut.frame.bits.sentBy.expect(it.header.direction)
          dut.frame.bits.distance.expect(255 - (if (it.header.hops == 255) 0 else it.header.hops))
          dut.frame.bits.kind.expect(if (it.isReserved) 2 else it.header.kind)
          if (!(it.isTaken && it.isMatch)) {
            waiting(q) = None
            dropped += 1
          }
        }
        if (dut.store.valid.peekBoolean())
          words(dut.store.bits.peekInt().toInt) = dut.stored.peekInt().toLong
        if (dut.accept.peekBoolean()) {
          val found = (words(0), dut.second.peekInt().toLong, words(2), words(3))
          val q     = waiting.indexWhere(_.exists(_.words == found))
          assert(q >= 0, s"cycle $cycle: $found is none of ${waiting.flatten.map(_.words).mkString(" and ")}")
          waiting(q) = None
          stored += 1
        }
        for (q <- 0 to 1) if (dut.home(q).valid.peekBoolean()) {
          val it = waiting(q).get
          assert(it.header.source == Own)
          dut.home(q).bits.leftBy.expect(it.header.direction)
          dut.home(q).bits.sequence.expect(it.header.sequence)
          waiting(q) = None
          homes += 1
        }
        dut.clock.step()
        dut.data.poke(byte)
      }
      val told = s"$stored stored, $dropped not, $homes at home, $given searches given up"
      assert(Seq(stored, dropped, homes, given).forall(_ > 5), told)
      info(told)
    }
}
