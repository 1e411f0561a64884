package flyframe.replay

import java.nio.file.Paths
import org.pcap4j.packet.namednumber.DataLinkType
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable
import scala.util.Random
import flyframe.transport._

/** Wireshark with `src/wireshark/ring.lua`, against frames and messages of the golden model. */
class RingDissectorSpec extends AnyFlatSpec {
  import RingDissectorSpec._

  private val folder    = Paths.get("build/replay")
  private val SocketCan = new DataLinkType(227, "CAN_SOCKETCAN")

  /** What tshark says of frames as SocketCAN has them. */
  private def tshark(name: String, frames: Seq[Seq[Int]], options: String*): Seq[String] =
    Recording.tshark(
      Recording.write(folder.resolve(s"ring-$name.pcap"), frames, SocketCan),
      Seq("-X", "lua_script:src/wireshark/ring.lua") ++ options: _*
    )

  /** The values of some fields in each frame; several ones of a field with commas between. */
  private def values(name: String, frames: Seq[BusFrame], fields: Seq[String]): Seq[Seq[String]] = {
    val form = Seq("-T", "fields", "-E", "separator=|")
    tshark(name, frames.map(can), form ++ fields.flatMap(Seq("-e", _)): _*).map(_.split("\\|", -1).toSeq)
  }

  /** The frames that a filter finds, from 0 on. */
  private def found(name: String, frames: Seq[Seq[Int]], filter: String, options: String*): Seq[Int] =
    tshark(name, frames, options ++ Seq("-Y", filter, "-T", "fields", "-e", "frame.number"): _*)
      .map(_.toInt - 1)

  /** Numbers may be shown in hexadecimal, with zeros in front. */
  private def plain(value: String): String = value match {
    case s"0x$digits" => java.lang.Long.parseLong(digits, 16).toString
    case "True"       => "1"
    case "False"      => "0"
    case other        => other
  }

  "TL-04, TP-01, TP-03, TP-50: the dissector" should "show every field of every kind of frame" in {
    val random = new Random(1)
    val made   = Seq.fill(100)(kinds).flatten.map(_(random))
    val fields = made.flatMap(_._2.keys).distinct.sorted
    val shown  = values("fields", made.map(_._1), fields)
    assert(shown.size == made.size)
    for (((frame, expected), line) <- made.zip(shown)) {
      val actual = fields.zip(line.map(plain)).toMap
      assert(fields.map(f => f -> expected.getOrElse(f, "")) == fields.map(f => f -> actual(f)), s"in $frame")
    }
  }

  it should "read the published vector" in {
    val frame  = BusFrame(0x0022e041, 4, Seq(5, 7, 0x41, 0x42))
    val fields = Seq("urgent", "dst", "src", "code", "pipe", "end", "message", "life", "whole")
    val shown  = values("vector", Seq(frame), fields.map("ring." + _))
    assert(
      shown.map(_.map(plain)) == Seq(Seq("0", "1", "23", Code.Short.toString, "0", "1", "5", "7", "4142"))
    )
  }

  it should "put messages together as their receivers do" in {
    val raw = new Traffic(0, 40, loses = false).frames.map(can)
    assert(found("whole", raw, "ring") == raw.indices && found("whole", raw, "ring.whole").size == 40)
    assert(found("whole", raw, "_ws.expert") == Nil)
  }

  it should "put them together when frames are lost" in {
    for (seed <- 1 to 5) {
      val traffic = new Traffic(seed, 40, loses = true)
      assert(traffic.frames.count(f => FrameId.of(f.id).number == Code.Missing) > 0, "nothing was missing")
      val fields =
        Seq("src", "dst", "pipe", "code", "message", "whole", "opened_in", "whole_in", "crc_right", "length")
      val lines = values(s"traffic-$seed", traffic.frames, fields.map("ring." + _))
        .map(line => fields.zip(line.map(plain)).toMap)
      val whole = lines.filter(_("whole") != "").map(l => l("src").toInt -> l("whole"))
      assert(whole.toSet == traffic.taken.toSet)
      // Only what goes in one frame can be seen twice.
      def long(messages: Seq[(Int, String)]) = messages.filter(_._2.length > 2 * Sizes.Short).sorted
      assert(long(whole) == long(traffic.taken.toSeq) && long(whole).size > 10)
      assert(lines.forall(_("crc_right") != "0"))
      val openings = Set(Code.Open, Code.Short).map(_.toString)
      // One that comes again may come when its sender has gone on to the next message (TB-06).
      def isLate(done: Map[String, String], at: Int) = lines
        .take(at)
        .findLast { l =>
          openings(l("code")) && l("src") == done("dst") && l("pipe") == done("pipe") &&
          Set(done("src"), "0")(l("dst"))
        }
        .exists(l => (l("message").toInt - done("message").toInt & 0xff) == 1)
      for ((done, at) <- lines.zipWithIndex if done("code") == Code.Done.toString)
        if (done("opened_in") == "") assert(isLate(done, at), done)
        else {
          val begin = lines(done("opened_in").toInt - 1)
          assert(openings(begin("code")))
          assert(begin("message") == done("message") && begin("src") == done("dst"))
          assert(begin("pipe") == done("pipe") && Set(done("src"), "0")(begin("dst")))
          val end = lines(done("whole_in").toInt - 1)
          if (begin("length") != "") assert(end("whole").length == 2 * begin("length").toInt)
        }
      val raw = traffic.frames.map(can)
      assert(found("right", raw, "_ws.expert && !ring.fits.expert") == Nil)
      assert(found("right", raw, "ring") == raw.indices)
    }
  }

  it should "say which rule a frame breaks" in {
    def control(code: Int, data: Int*) = BusFrame(FrameId(false, 2, false, 3, code, 4, true), data)
    def part(number: Int, end: Boolean, n: Int) =
      BusFrame(FrameId(false, 2, true, 3, number, 4, end), Seq.fill(n)(7))
    def change(frame: BusFrame)(f: FrameId => FrameId) = frame.copy(id = f(FrameId.of(frame.id)).word)
    val (open, done) = (control(Code.Open, 0, 0, 0, 9, 1, 2, 3, 4), control(Code.Done, 0, 0, 0, 0))
    val cases = Seq(
      part(0, false, 8)                             -> "fits",   // of no message
      open                                          -> "",
      part(0, false, 8)                             -> "",
      part(1, true, 3)                              -> "fits",   // longer than the message
      part(2, true, 2)                              -> "fits",   // behind its end
      part(1, false, 8)                             -> "fits",   // without its end mark
      part(1, true, 2)                              -> "crc",
      control(Code.Done, 0, 0, 0, 2)                -> "result", // all of it again
      open                                          -> "",
      part(0, false, 8)                             -> "",
      part(1, true, 2)                              -> "crc",
      control(Code.Close, 0, 0)                     -> "",
      part(0, false, 8)                             -> "fits",   // behind CLOSE
      done                                          -> "",
      control(Code.Open, 1, 0, 0, 9)                -> "dlc",
      control(Code.Short, 1, 0)                     -> "dlc",
      control(Code.Open, 1, 0, 0, 5, 1, 2, 3, 4)    -> "field",  // as long as a SHORT
      control(Code.Open, 1, 0, 8, 0, 1, 2, 3, 4)    -> "field",  // 2,049 bytes
      control(Code.Short, 1, 0x80, 1)               -> "field",  // about a message to all, to one
      control(Code.Done, 0, 0, 0, 3)                -> "field",
      control(Code.Done, 0, 0, 0, 1)                -> "result",
      control(Code.Missing, 0, 0, 0, 0, 0, 0, 0, 0) -> "field",  // names nothing
      control(Code.Unknown, 1)                      -> "field",
      control(Code.Hello, 0, 1, 2, 3, 4, 5, 6, 7)   -> "field",  // to one node
      control(0x33)                                 -> "code",
      change(done)(_.copy(destination = 0))         -> "field",
      change(done)(_.copy(end = false))             -> "field",
      change(done)(_.copy(pipe = 15))               -> "field",
      change(part(7, false, 1))(_.copy(pipe = 15))  -> "field",  // a value without end mark
      change(part(7, true, 0))(_.copy(pipe = 15))   -> "",
      change(part(0, true, 0))(_.copy(number = 9))  -> "dlc",
      part(9, false, 7)                             -> "dlc"
    )
    val raw = cases.map(c => can(c._1))
    for (kind <- cases.map(_._2).distinct if kind != "") {
      // A data frame with an impossible DLC does not fit either.
      val expected = cases.indices.filter(n =>
        cases(n)._2 == kind || kind == "fits" && cases(n)._2 == "dlc" &&
          FrameId.of(cases(n)._1.id).isData
      )
      assert(found("wrong", raw, s"ring.$kind.expert") == expected, kind)
      assert(found("wrong", raw, s"ring.$kind.expert", "-2") == expected, s"$kind, the second time")
    }
  }

  it should "leave frames of others alone, and survive any" in {
    val random = new Random(2)
    val good   = can(kinds.head(random)._1)
    val others = Seq(
      good.updated(0, good.head & 0x1f), // 11 bits
      good.updated(0, good.head | 0x40), // remote
      good.updated(0, good.head | 0x20), // an error
      can(BusFrame(1 << 21, 0, Nil)),    // source 0
      can(BusFrame(1 << 21 | 126 << 13, 0, Nil)),
      can(BusFrame(126 << 21 | 2 << 13, 0, Nil))
    )
    assert(found("others", others :+ good, "ring") == Seq(others.size))

    val any = Seq.fill(3000) {
      val code =
        if (random.nextBoolean()) random.nextInt(256) else Seq(1, 2, 3, 17, 18, 19, 20, 32)(random.nextInt(8))
      val id   = random.nextInt(1 << 29) & ~(0xff << 5) | code << 5
      val data = Seq.fill(random.nextInt(9))(random.nextInt(256))
      BusFrame(id, data.size, data)
    }
    val possible = any.indices.filter { n =>
      val id = FrameId.of(any(n).id)
      (1 to Sizes.LastAddress).contains(id.source) && id.destination <= Sizes.LastAddress
    }
    assert(found("any", any.map(can), "ring") == possible)
    val text = tshark("any", any.map(can), "-V")
    assert(text.size > 20 * any.size)
    assert(text.filter(_.contains("Lua Error")) == Nil)
  }
}

object RingDissectorSpec {

  /** As link type 227 has it: identifier with the mark of 29 bits, length, three zeros, data. */
  def can(f: BusFrame): Seq[Int] = Sizes.bytes(0x80000000L | f.id, 4) ++ Seq(f.dlc, 0, 0, 0) ++ f.data

  def hex(bytes: Seq[Int]): String = bytes.map(b => f"$b%02x").mkString

  /** A frame, and what is to be shown of it. */
  type Made = (BusFrame, Map[String, String])

  private def some(random: Random, count: Int) = Seq.fill(count)(random.nextInt(256))
  private def one(set: Boolean): Int           = if (set) 1 else 0

  private def made(id: FrameId, data: Seq[Int], content: (String, Any)*): Made = BusFrame(id, data) -> (Map(
    "ring.urgent" -> one(!id.urgent).toString,
    "ring.dst"    -> id.destination.toString,
    "ring.type"   -> one(id.isData).toString,
    "ring.src"    -> id.source.toString,
    "ring.pipe"   -> id.pipe.toString,
    "ring.end"    -> one(id.end).toString
  ) ++ content.map { case (field, value) => s"ring.$field" -> value.toString })

  /** Destination 0 only where it is asked for. */
  private def id(random: Random, isData: Boolean, number: Int, end: Boolean, to: Option[Int] = None) =
    FrameId(
      random.nextBoolean(),
      to.getOrElse(1 + random.nextInt(Sizes.LastAddress)),
      isData,
      1 + random.nextInt(Sizes.LastAddress),
      number,
      random.nextInt(Sizes.ProcessData),
      end
    )

  /** Frames of a sender, about one message. */
  private def asks(code: Int)(more: Random => (Seq[Int], Seq[(String, Any)])): Random => Made = random => {
    val all              = random.nextInt(4) == 0
    val (number, life)   = (random.nextInt(256), random.nextInt(128))
    val (bytes, content) = more(random)
    val head: Seq[(String, Any)] =
      Seq("code" -> code, "message" -> number, "life" -> life, "to_all" -> one(all))
    val data = Seq(number, life | (if (all) Sizes.ToAll else 0)) ++ bytes
    made(id(random, isData = false, code, end = true, Option.when(all)(0)), data, head ++ content: _*)
  }

  /** Frames of a receiver. */
  private def answers(code: Int)(more: Random => (Seq[Int], Seq[(String, Any)])): Random => Made = random => {
    val (number, life, all) = (random.nextInt(256), random.nextInt(128), random.nextBoolean())
    val (bytes, content)    = more(random)
    val head: Seq[(String, Any)] =
      Seq("code" -> code, "message" -> number, "life" -> life, "to_all" -> one(all))
    val data = Seq(number, life | (if (all) Sizes.ToAll else 0)) ++ bytes
    made(id(random, isData = false, code, end = true), data, head ++ content: _*)
  }

  /** A frame at random of each kind. */
  val kinds: Seq[Random => Made] = Seq(
    asks(Code.Open) { random =>
      val (length, crc) = (Sizes.Short + 1 + random.nextInt(Sizes.Message - Sizes.Short), some(random, 4))
      (Sizes.bytes(length - 1L, 2) ++ crc, Seq("length" -> length, "crc" -> Sizes.number(crc)))
    },
    asks(Code.Short) { random =>
      val data = some(random, 1 + random.nextInt(Sizes.Short))
      (data, Seq("whole" -> hex(data)))
    },
    asks(Code.Close)(_ => (Nil, Nil)),
    answers(Code.Done) { random =>
      val (own, result) = (random.nextInt(128), random.nextInt(3))
      (Seq(own, result), Seq("own_life" -> own, "result" -> result))
    },
    answers(Code.Missing) { random =>
      val first   = random.nextInt(256)
      val missing = 0 +: (1 until Sizes.Map).filter(_ => random.nextInt(3) == 0)
      val map     = Sizes.bytes(missing.map(i => 1L << Sizes.Map - 1 - i).sum, 5)
      val names   = missing.map(first + _).mkString(",")
      (first +: map, Seq("first_missing" -> first, "map" -> hex(map), "missing" -> names))
    },
    answers(Code.Busy) { random =>
      val wait = random.nextInt(256)
      (Seq(wait), Seq("wait" -> 10 * wait))
    },
    random => {
      val all  = random.nextBoolean()
      val data = Seq(if (all) Sizes.ToAll else 0)
      val name = id(random, isData = false, Code.Unknown, end = true)
      made(name, data, "code" -> Code.Unknown, "life" -> 0, "to_all" -> one(all))
    },
    random => {
      val data   = some(random, 8)
      val fields = Seq("state", "ports", "can_f", "can_t").zip(data.slice(1, 5))
      val all = Seq("life" -> (data.head & 0x7f)) ++ fields ++
        Seq("type" -> Sizes.number(data.slice(5, 7)), "version" -> data(7))
      val name = id(random, isData = false, Code.Hello, end = true, Some(0)).copy(pipe = 0)
      made(name, data, ("code" -> Code.Hello) +: all.map { case (f, v) => s"hello.$f" -> v }: _*)
    },
    random => {
      val end  = random.nextBoolean()
      val data = some(random, if (end) 1 + random.nextInt(8) else 8)
      val n    = random.nextInt(256)
      made(id(random, isData = true, n, end), data, "number" -> n, "data" -> hex(data))
    },
    random => {
      val (n, data) = (random.nextInt(256), some(random, random.nextInt(9)))
      val name      = id(random, isData = true, n, end = true).copy(pipe = Sizes.ProcessData)
      val value     = if (data.isEmpty) Nil else Seq("value" -> hex(data))
      made(name, data, Seq("object" -> n, "valid" -> one(data.nonEmpty)) ++ value: _*)
    }
  )

  /** Two nodes send each other messages; a bus that loses frames loses one in ten. What it does not lose is
    * recorded.
    */
  class Traffic(seed: Int, messages: Int, loses: Boolean) {
    private val random = new Random(seed)
    private val nodes  = Seq(2, 3).map(address => address -> new TransportModel(TransportParams(address), 0))
    private val sentFrames = mutable.Buffer.empty[BusFrame]

    /** What hosts have got: source, and bytes. */
    val taken = mutable.Buffer.empty[(Int, String)]

    private var (now, sent, over) = (0L, 0, 0)
    while (over < messages) {
      now += 200
      assert(now < 60000000, s"seed $seed: $over messages have ended after a minute")
      for ((address, node) <- nodes) {
        val (other, peer) = nodes.find(_._1 != address).get
        if (sent < messages && random.nextInt(20) == 0) {
          // Bytes that no other message has.
          val data =
            Sizes.bytes(sent.toLong, 2) ++ some(random, random.nextInt(if (random.nextBoolean()) 5 else 600))
          val to = if (random.nextInt(5) == 0) 0 else other
          if (node.send(sent, to, random.nextBoolean(), data, now, Option.when(to == 0)(Set(other))))
            sent += 1
        }
        node.poll(now)
        for (f <- node.queued()) {
          node.left(f.id)
          if (!loses || random.nextInt(10) > 0) {
            sentFrames += f
            peer.receive(f, now)
          }
        }
        for (m <- node.received) {
          taken += (m.source -> hex(m.data))
          node.take(now)
        }
        for (e <- node.ended()) {
          assert(e.outcome == Outcome.Delivered, s"seed $seed: $e")
          over += 1
        }
      }
    }

    /** What was on the bus, in order. */
    val frames: Seq[BusFrame] = sentFrames.toSeq
  }
}
