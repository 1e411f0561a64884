package flyframe.relay

import flyframe.Tier
import flyframe.can.CanFrame
import flyframe.params.CanParams
import flyframe.registers.{CanRegisters, RingRegisters}
import org.scalatest.flatspec.AnyFlatSpec
import scala.collection.mutable
import scala.collection.mutable.ArrayBuffer

/** What the host does in any cycle around what happens to own frames, a node of relay mode in RTL beside the
  * golden model. All of an order counts at one moment: with the end of the access, or with the end of a bit
  * not long before that, since the node still decides behind the end of a bit (RB-19).
  */
class HostInAnyCycleSpec extends AnyFlatSpec {
  private val Bit  = LinkTiming.Least
  private val port = CanRegisters.PortStarts(0)

  /** @param isLife
    *   it is about the start of the life, else about a frame behind that
    * @param comesHome
    *   the copies of the frame come home, else they are lost
    * @param happens
    *   it has happened in the model
    * @param isOther
    *   the frame is one of another node that comes by port 1
    */
  private case class Scene(
      name: String,
      isLife: Boolean,
      comesHome: Boolean,
      happens: RelayModel => Boolean,
      isOther: Boolean = false
  )

  private def isRepeated(m: RelayModel) = m.node.counters(RelayCounter.Repeated) > 0
  private val scenes = Seq(
    Scene("the start of a life is made", isLife = true, comesHome = true, !_.node.own.isEmpty),
    Scene("a frame begins", isLife = false, comesHome = true, !_.node.own.isEmpty),
    Scene("a frame is confirmed", isLife = false, comesHome = true, m => ended(m, RelayCounter.Confirmed)),
    Scene("a frame is repeated", isLife = false, comesHome = false, isRepeated),
    Scene("a frame fails", isLife = false, comesHome = false, m => ended(m, RelayCounter.Failed)),
    Scene(
      "a frame passes",
      isLife = false,
      comesHome = false,
      m => ended(m, RelayCounter.Passed + 1),
      isOther = true
    )
  )
  private def ended(m: RelayModel, counter: Int) = m.node.counters(counter) > 0

  private val Other = {
    val header = LinkHeader(LinkKind.Data, 1, 40, 3, 100)
    LinkFrame.levels(header, LinkBody.of(header, CanFrame(1, extended = false, remote = false, 1, Seq(7))))
  }

  /** Cycles from the decision that a frame begins to the end of that bit, and those of an access. */
  private val Decided = Bit - Schedule(CanParams()).decisions.head + 4

  private val relay = 1 << RingRegisters.Relay
  private val orders = Seq[(String, Int, Seq[Int])](
    ("an abort", port + CanRegisters.Aborts, Seq(1, 0)),
    ("an abort of all", port + CanRegisters.Command, Seq(4)),
    ("a change of one shot", port + CanRegisters.Control, Seq(8)),
    ("a change of how long it waits", RingRegisters.Confirm, Seq(60, 0)),
    ("a change of how often it repeats", RingRegisters.Retries, Seq(0)),
    ("another life", RingRegisters.Life, Seq(6)),
    ("the end of a conflict", RingRegisters.Control, Seq(relay | 1 << RingRegisters.ClearConflict)),
    ("the end of relay mode", RingRegisters.Control, Seq(0))
  )

  /** From which cycle to which an access lasted: what it has written counts from the last one on. */
  private case class Write(begins: Long, ends: Long, address: Int, bytes: Seq[Int])

  /** What a node in RTL heard and sent, cycle by cycle, what was written, and what is read at the end. */
  private class Recording {
    val heard  = ArrayBuffer.empty[(Boolean, Boolean)]
    val sent   = ArrayBuffer.empty[(Boolean, Boolean)]
    val up     = ArrayBuffer.empty[Boolean]
    val writes = ArrayBuffer.empty[Write]
    var shown  = Seq.empty[Int]
    var order  = Option.empty[Write]

    /** The cycle in which the mode is on, or the frame requested. */
    var asked = 0L
  }

  private val shown = Seq(port + CanRegisters.Requests -> 2, port + CanRegisters.Sent -> 4, 0x24 -> 12) ++
    Seq(RingRegisters.Control -> 1, RingRegisters.LinkBit -> 8, 0x30 -> 16)
  private def show(node: RelayUnderTest) =
    shown.flatMap { case (from, count) => node.read(from, count) } :+ (node
      .read(RingRegisters.State, 1)
      .head & 0x10)

  private def record(scene: Scene, order: Option[(Int, Seq[Int], Long)]): Recording = {
    val r = new Recording
    RelaySimulation { rtl =>
      var isUp     = false
      var isLooped = true
      val other    = mutable.Queue.empty[Boolean]
      def cycle(): Unit = {
        val levels = (rtl.level(0), rtl.level(1))
        r.sent += levels
        r.heard += (
          if (isLooped) levels.swap else (true, other.isEmpty || other.dequeue())
        )
        r.up += isUp
        rtl.step(r.heard.last, (isUp, isUp))
      }
      rtl.passes = () => cycle()
      def access(address: Int, bytes: Seq[Int]): Write = {
        val begins = rtl.cycle
        rtl.write(address, bytes)
        Write(begins, rtl.cycle, address, bytes)
      }
      def write(address: Int, bytes: Int*): Long = {
        r.writes += access(address, bytes)
        rtl.cycle
      }
      def run(bits: Int): Unit = for (_ <- 0 until bits * Bit) cycle()
      write(RingRegisters.Address, 7)
      write(RingRegisters.Confirm, 2, 0)
      write(RingRegisters.Retries, 1)
      write(RingRegisters.Life, 5)
      val frame = CanFrame(0x1234, extended = true, remote = false, 1, Seq(7)).bytes()
      for (i <- Seq(0, 4, 8)) write(CanRegisters.SlotStarts(0) + i, frame.slice(i, i + 4): _*)
      while (rtl.cycle % Bit != 8) cycle() // whoever is switched on between two ends of bits
      r.asked = write(RingRegisters.Control, relay)
      isUp = true
      if (!scene.isLife) {
        run(260)
        isLooped = scene.comesHome
        if (scene.isOther) {
          r.asked = rtl.cycle
          other ++= Other.flatMap(Seq.fill(Bit)(_))
        } else r.asked = write(port + CanRegisters.Requests, 1, 0)
      }
      for ((address, bytes, at) <- order) {
        while (rtl.cycle < at) cycle()
        r.order = Some(access(address, bytes))
      }
      while (rtl.cycle < r.asked + 450 * Bit) cycle()
      r.shown = show(rtl)
    }
    r
  }

  /** The model hears the same, and the order counts in cycle `at`.
    *
    * @return
    *   the cycle in which the scene's event happens; none if it sends or shows something else
    */
  private def replay(r: Recording, scene: Scene, at: Long): Either[String, Long] = {
    val model   = new RelayModel
    val atCycle = (r.writes ++ r.order.map(_.copy(ends = at))).groupBy(_.ends)
    var event   = -1L
    for (c <- r.sent.indices) {
      for (w <- atCycle.getOrElse(c.toLong, Nil)) model.write(w.address, w.bytes)
      if (r.sent(c) != ((model.level(0), model.level(1)))) return Left(s"differs in cycle $c")
      model.step(r.heard(c), (r.up(c), r.up(c)))
      if (event < 0 && c > r.asked && scene.happens(model)) event = c.toLong
    }
    val now = show(model)
    if (now == r.shown) Right(event) else Left(s"the model shows $now, the RTL ${r.shown}")
  }

  private val tier =
    Tier("a host in any cycle around what happens in relay mode", "accesses", test = 70, soak = 3000)

  "RB-12, RB-13, RB-19, RB-25, RB-28: an order in any cycle around what happens to own frames" should
    "count at one moment, as in the model" in tier.run("all", tier.size) {
      val all = for {
        scene <- scenes
        event = happens(scene)
        (name, address, bytes) <- orders
        cycle                  <- event - 2 * Bit until event + Bit
      } yield (scene, name, address, bytes, cycle)
      val step = (all.size / tier.size).toInt max 1
      for ((scene, name, address, bytes, cycle) <- all.indices.by(step).map(all))
        check(scene, name, address, bytes, cycle)
    }

  "RB-25: relay mode that ends in any cycle between the decision that a frame begins and that" should
    "count the frame only if it leaves" in {
      val (name, address, bytes) = orders.find(_._1 == "the end of relay mode").get
      for {
        scene <- scenes.filter(s => Seq("a frame begins", "a frame passes").contains(s.name))
        event = happens(scene)
        cycle <- event + Bit - Decided until event + Bit + 2
      } check(scene, name, address, bytes, cycle)
    }

  /** The cycle in which it happens if the host does nothing. */
  private def happens(scene: Scene): Long = {
    val event = replay(record(scene, None), scene, 0).fold(fail(_), identity)
    assert(event > 0, s"it has not happened: ${scene.name}")
    event
  }

  private def check(scene: Scene, name: String, address: Int, bytes: Seq[Int], cycle: Long): Unit = {
    val r     = record(scene, Some((address, bytes, cycle)))
    val o     = r.order.get
    val ticks = (o.begins - Bit until o.ends).filter(_ % Bit == Bit - 1)
    val tries = (o.ends +: ticks).map(replay(r, scene, _))
    assert(
      tries.exists(_.isRight),
      s"$name in cycle $cycle, ${cycle % Bit} of its bit: ${scene.name}: ${tries.mkString("; ")}"
    )
  }
}
