package flyframe.transport

import flyframe.Tier
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable
import scala.util.Random

/** Random frames at a node in each of its states, at the model and at C (under ASan and UBSan) at the same
  * time: both must say and count the same, nothing may be delivered that nobody has sent, and messages go on
  * afterwards.
  */
class FuzzSpec extends AnyFlatSpec {
  import FuzzSpec._
  import TransportCases._

  private val tier =
    Tier("Random frames at a transport in each of its states", "frames", test = 30000, soak = 2000000)
  private val Round = 100

  for (((name, prepare), i) <- states.zipWithIndex)
    s"TP-13, TP-30, TB-19: random frames at a node with $name" should "deliver nothing wrong, and end" in {
      val frames = tier.size / states.size
      val counts = tier.run(name, frames, Some(i.toLong)) {
        val random = new Random(i)
        (0L until frames / Round).map(n => round(s"seed $i, round $n", prepare, random)).flatten
      }
      val kinds = counts.groupMapReduce(_._1)(_._2)(_ + _)
      assert(kinds.size >= 14, kinds) // something of almost all kinds came
      info(kinds.toSeq.sortBy(_._1).map { case (c, n) => s"$c $n" }.mkString(", "))
    }

  /** @return what was counted */
  private def round(name: String, prepare: Bench => Unit, random: Random): Map[Counter.Value, Int] = {
    val params = TransportParams(Own, life = 7)
    val inC    = new NodeInC(params, Start)
    val nodes  = Seq(new TransportModel(params, Start), inC).map(new Bench(_))

    /** Both nodes do the same, in any order of frames. */
    def both[A](what: String)(body: Bench => A): A = {
      val Seq(model, c) = nodes.map(body)
      assert(model == c, s"$name: $what")
      model
    }
    def said(what: String)(body: Bench => Seq[BusFrame]): Unit = {
      val frames = both(what)(b => body(b).sortBy(f => (f.id, f.data.mkString(" "))))
      assert(frames.forall(f => FrameId.of(f.id).source == Own && f.dlc <= 8), name)
    }

    val heard = mutable.Buffer.empty[BusFrame]
    def take(refuse: Boolean): Unit = if (both("received")(_.t.received).nonEmpty) {
      val m = both("taken")(_.take(refuse))
      assert(hasSent(heard.toSeq, m), s"$name: $m was never sent")
      said("behind it")(_.run())
    }
    nodes.foreach(prepare)
    heard ++= prepared
    for (n <- 1 to Round) {
      val frame = Frames.any(random)
      val us    = if (random.nextInt(4) == 0) ms(random.nextInt(20)) else 0L
      heard += frame
      val leaves = random.nextBoolean()
      said(s"frame $n, $frame") { b =>
        b.t.receive(frame, b.now)
        if (leaves) b.leave(b.waiting.headOption.contains(_))
        b.run(us)
      }
      if (random.nextInt(10) == 0) take(random.nextInt(4) == 0)
    }
    for (e <- both("ended")(_.ended()) if e.outcome == Outcome.Delivered)
      assert(
        heard.exists(f => !isData(f) && code(f) == Code.Done && f.data.lift(3).contains(0)),
        s"$name: $e"
      )
    val counts = both("counted")(_.counts)

    // What was under way ends, and others go on.
    nodes.foreach { b => b.isHeld = false; b.leave() }
    while (both("the rest")(_.t.received).nonEmpty) take(refuse = false)
    both("silence")(b => { b.run(ms(30000)); b.ended().map(_.outcome) })
    val (last, other)     = (message(2048), 77)
    def from(f: BusFrame) = f.copy(id = FrameId.of(f.id).copy(source = other).word)
    both("a message afterwards") { b =>
      b.hear((open(9, last, 3) +: parts(last, 3)).map(from): _*)
      assert(b.take().data == last, name)
      assert(b.run().map(code) == Seq(Code.Done), name)
      b.send(Seq(1), tag = 100, to = other)
      b.hear(done(0, from = other))
      assert(b.ended() == Seq(Ended(100, Outcome.Delivered, Set())), name)
    }
    inC.release()
    counts
  }
}

object FuzzSpec {
  import TransportCases._

  private val incoming = message(60)
  private val coming   = open(0, incoming) +: parts(incoming).take(3)
  private val full =
    (0 to 3).map(open(0, incoming, _)) ++ (4 to 10).map(short(0, Seq(1, 2, 3), _)) :+
      short(0, Seq(1, 2, 3), 11, urgent = true)

  /** What peers send before the random frames. */
  private val prepared = coming ++ full :+ short(0, Seq(1, 2, 3))

  private val states: Seq[(String, Bench => Unit)] = Seq(
    "nothing under way"            -> (_ => ()),
    "a message coming in"          -> (_.hear(coming: _*)),
    "a whole message for its host" -> (_.hear(short(0, Seq(1, 2, 3)))),
    "all buffers full"             -> (_.hear(full: _*)),
    "frames going out" -> { b =>
      b.isHeld = true
      b.send(message(300))
    },
    "an answer awaited"     -> (_.send(message(30))),
    "a short one sent"      -> (_.send(Seq(1, 2))),
    "its receiver busy"     -> { b => b.send(message(30)); b.hear(busy(0, 200)) },
    "a message to all"      -> (_.send(message(30), to = 0, members = Some(Set(1, Peer, 125)))),
    "a message almost lost" -> { b => b.send(message(30)); b.run(ms(460)) }
  )

  /** Whether a message was sent by these frames: as SHORT, or its CRC in OPEN. */
  private def hasSent(frames: Seq[BusFrame], m: Received): Boolean = frames.exists { f =>
    val id = FrameId.of(f.id)
    !id.isData && id.source == m.source && id.pipe == m.pipe && (id.destination == 0) == m.toAll &&
    f.data.headOption.contains(m.number) &&
    (if (m.data.size <= Sizes.Short) id.number == Code.Short && f.data.drop(2) == m.data
     else
       id.number == Code.Open && f.data.slice(2, 4) == Sizes.bytes(m.data.size - 1, 2) &&
       f.data.drop(4) == Sizes.bytes(Sizes.crc32(m.data), 4))
  }

  /** Random frames that often come near to what they could be. */
  private object Frames {
    private val codes = Seq(1, 2, 3, 0x11, 0x12, 0x13, 0x14, 0x20)
    private val dlcs  = Map(1 -> 8, 2 -> 5, 3 -> 2, 0x11 -> 4, 0x12 -> 8, 0x13 -> 3, 0x14 -> 1, 0x20 -> 8)

    private def one[A](random: Random)(choices: A*): A = choices(random.nextInt(choices.size))

    def any(random: Random): BusFrame = {
      def r(n: Int)     = random.nextInt(n)
      def pick(n: Int*) = one(random)(n: _*)
      val isData        = r(3) == 0
      val source        = if (r(6) > 0) Peer else pick(0, 1, Own, 125, 126, 127, r(128))
      val to            = if (r(6) > 0) Own else pick(0, 0, 0, 1, 126, r(128))
      val pipe          = if (r(3) > 0) 0 else pick(0, 1, 2, 14, 15, r(16))
      val (number, end, dlc) =
        if (isData) one(random)(parts :+ ((r(256), r(2) == 1, r(16))): _*)
        else {
          val code = if (r(20) > 0) one(random)(codes: _*) else r(256)
          (code, r(20) > 0, if (r(20) > 0) dlcs.getOrElse(code, 8) else r(16))
        }
      BusFrame(
        FrameId(r(8) == 0, to, isData, source, number, pipe, end).word,
        dlc,
        (if (isData) Seq.fill(8)(0) else control(random, number, to == 0)).padTo(8, 0).take(dlc min 8)
      )
    }

    /** Number, end mark and DLC of data frames: those of messages of 7, 8 and 20 bytes, and others. */
    private val parts = Seq(
      (0, true, 7),
      (0, true, 8),
      (0, false, 8),
      (1, false, 8),
      (2, true, 4),
      (3, false, 8),
      (255, true, 8),
      (7, true, 4)
    )

    private def control(random: Random, code: Int, toAll: Boolean): Seq[Int] = {
      def r(n: Int)     = random.nextInt(n)
      def pick(n: Int*) = one(random)(n: _*)
      val bit           = if (toAll != (r(20) == 0)) 0x80 else 0
      val number        = pick(0, 0, 0, 1, 1, 2, 255, r(256))
      val life = if (code < Code.Done) if (r(30) > 0) Life else pick(4, 6, r(128)) else pick(7, 7, 7, r(128))
      val rest = code match {
        case Code.Open =>
          val length = pick(7, 7, 8, 8, 20, 20, 60, 2048, 2049, 1, 65536, 1 + r(65536))
          val crc    = if (r(4) == 0) r(9) else Sizes.crc32(Seq.fill(length min 2049)(0))
          Sizes.bytes(length - 1, 2) ++ Sizes.bytes(crc, 4)
        case Code.Done    => Seq(0, pick(0, 0, 1, 2, 3))
        case Code.Missing => pick(0, 1, 2, 240, r(256)) +: Seq.fill(5)(pick(0, 0, 0x80, r(256)))
        case Code.Busy    => Seq(pick(0, 1, 255))
        case _            => Seq.fill(6)(r(256))
      }
      if (code == Code.Unknown) Seq(pick(0, 0x80, 1)) ++ rest
      else if (code == Code.Hello) Seq(life, r(256)) ++ rest
      else Seq(number, life | bit) ++ rest
    }
  }
}
