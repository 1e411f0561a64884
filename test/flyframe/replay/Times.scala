package flyframe.replay

import scala.collection.mutable
import flyframe.rules.Reply

/** Times of distributed clocks in a replayed recording. They are not those of then, as every controller
  * counts from its own power-on, and idle time is left out of a replay; but they must be of the same kind:
  * what came back then comes back, what lay behind lies behind, and time goes on.
  */
object Times {

  /** The byte is one of a time, or of the difference between two. */
  def isTime(address: Int): Boolean = (address & ~0x1f) == 0x0900 || (address & ~3) == Difference

  /** So many times were compared in kind, and what is wrong about them. */
  final case class Verdict(compared: Int, wrong: Seq[String])

  private val Trigger    = 0x0900
  private val SystemTime = 0x0910
  private val Processing = 0x0918
  private val Offset     = 0x0920
  private val Difference = 0x092c

  /** A frame is away for less than this, ns. */
  private val Away = 1000000L

  /** The 32 bits at an address then, and now. */
  private final case class Value(recorded: Long, actual: Long)

  /** Receive times that one slave has kept of one frame: those of ports 0 to 3, and what is read at 0x0918.
    */
  private final class Kept(val slave: Int, val ports: mutable.Map[Int, Value], var unit: Option[Value]) {

    /** How long the frame was away behind port `y`; None: it did not go there, or nothing was stamped (0). */
    def away(y: Int, of: Value => Long): Option[Long] =
      for {
        back  <- ports.get(y) if of(back) != 0
        first <- ports.get(0)
        ns = word(of(back) - of(first)) if ns > 0 && ns < Away
      } yield ns
  }
  private def word(value: Long): Long = value & 0xffffffffL

  /** All datagrams of a recording in order, each with what has come back now. */
  def check(datagrams: Seq[(Addressed, Reply)]): Verdict = {
    var compared = 0
    val wrong    = mutable.Buffer.empty[String]
    val kept     = mutable.Map.empty[Int, Kept]
    val latest   = mutable.Map.empty[Int, Value] // system time, by slave

    def expect(holds: Boolean, d: Addressed)(sentence: => String): Unit =
      if (!holds) wrong += s"frame ${d.frame}: $sentence"
    def line(d: Addressed): Unit = for (y <- 1 to 3) {
      val ways =
        kept.toSeq.sortBy(_._1).map(_._2).flatMap(k => k.away(y, _.recorded).zip(k.away(y, _.actual)))
      for (((then1, now1), (then2, now2)) <- ways.zip(ways.drop(1)))
        expect((then1 > then2) == (now1 > now2), d)(
          s"the way behind port $y was $then1, $then2, is $now1, $now2"
        )
    }

    def isLogical(d: Addressed) = d.reply.command >= 10 && d.reply.command <= 12
    for ((d, actual) <- datagrams if d.reply.workingCounter > 0 && !isLogical(d)) {
      def at(address: Int): Option[Value] = {
        def of(reply: Reply) =
          (0 to 3).map(i => reply.data(address + i - reply.ado).toLong << (8 * i)).sum
        Option.when(address >= d.reply.ado && address + 4 <= d.reply.ado + d.reply.length)(
          Value(of(d.reply), of(actual))
        )
      }
      if (d.writes) {
        if (d.touches(Trigger to Trigger)) d.slaves.foreach(kept.remove)
        if (d.touches(SystemTime until SystemTime + 4) || d.touches(Offset until Offset + 8))
          d.slaves.foreach(latest.remove)
      }
      if (d.reads && d.slaves.size == 1) {
        val slave = d.slaves.head
        val mine  = kept.getOrElseUpdate(slave, new Kept(slave, mutable.Map.empty, None))
        for (y <- 0 to 3; value <- at(Trigger + 4 * y)) {
          compared += 1
          mine.ports(y) = value
          if (y > 0) {
            val (before, now) = (mine.away(y, _.recorded), mine.away(y, _.actual))
            expect(before.isDefined == now.isDefined, d)(s"slave $slave, port $y: away $now, was $before")
            expect(now.isDefined || value.actual == 0, d)(s"slave $slave, port $y has a time")
          }
        }
        for (value <- at(Processing)) {
          compared += 1
          mine.unit = Some(value)
        }
        for (unit <- mine.unit; first <- mine.ports.get(0))
          expect((unit.recorded == first.recorded) == (unit.actual == first.actual), d)(
            s"slave $slave: port 0 has $first, the processing unit $unit"
          )
        line(d)
        for (value <- at(SystemTime)) {
          compared += 1
          for (last <- latest.get(slave)) {
            val (before, now) = (word(value.recorded - last.recorded), word(value.actual - last.actual))
            expect(now > 0 && now < before + before / 1000 + 10000, d)(s"slave $slave: $now ns, were $before")
          }
          latest(slave) = value
        }
        for (value <- at(Difference)) {
          compared += 1
          expect((value.recorded == 0) == (value.actual == 0), d)(s"slave $slave: difference is $value")
        }
      }
    }
    Verdict(compared, wrong.toSeq)
  }
}
