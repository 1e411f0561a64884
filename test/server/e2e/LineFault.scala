package flyframe.e2e

import java.nio.file.{Files, StandardCopyOption}
import scala.util.Random
import flyframe.system.Fault

/** A fault of [[Fault]], as a system in RTL has it.
  *
  * @param begin
  *   brings it about; what ends it
  * @param again
  *   what of it happens now and then while it lasts
  * @param shown
  *   where it is seen before long
  * @param hidesPage
  *   there is no page, or it knows of nothing
  * @param restarts
  *   slaves lose their power
  */
final case class LineFault(
    name: String,
    begin: AlarmSystem => () => Unit,
    again: AlarmSystem => Unit = _ => (),
    shown: LineFault.Shown = LineFault.Later,
    hidesPage: Boolean = false,
    restarts: Boolean = false
)

object LineFault {
  sealed trait Shown
  case object AtPanel extends Shown
  case object OnPage  extends Shown

  /** Not before a time-out in seconds, or not while it lasts. */
  case object Later extends Shown

  private def during(begin: String*)(end: String*): AlarmSystem => () => Unit = { system =>
    begin.foreach(system.bench)
    () => end.foreach(system.bench)
  }

  /** Slaves have other node IDs, which their hosts learn when they start. */
  private def renamed(ids: (Int, Int)*): AlarmSystem => () => Unit = {
    def name(system: AlarmSystem, ids: Seq[(Int, Int)]) = {
      for ((slave, id) <- ids) system.bench(s"node $slave $id")
      restarted(system, ids.map(_._1): _*)
    }
    system => {
      name(system, ids)
      () => name(system, ids.map { case (slave, _) => slave -> slave })
    }
  }

  /** They are without power for a moment, in which others are out of reach. */
  private def restarted(system: AlarmSystem, slaves: Int*): Unit = {
    slaves.foreach(s => system.bench(s"restart $s 1000"))
    system.await("all have power")(system.status("slaves").arr.forall(_("powered").bool))
  }

  /** A slave's host takes longer to start than the fires last. Before its end it is without power again: a
    * reset of a detector whose host has not set its off time lasts two seconds.
    */
  private def slowHost(slave: Int)(system: AlarmSystem): () => Unit = {
    system.bench(s"host $slave boot 500")
    restarted(system, slave)
    () => {
      system.bench(s"host $slave boot 0")
      restarted(system, slave)
    }
  }

  /** The server notices it as it does a disk that is full: no transaction begins. */
  private def noDisk(system: AlarmSystem): () => Unit = {
    val aside = system.folder.resolve("aside.db")
    Files.move(system.database, aside, StandardCopyOption.ATOMIC_MOVE)
    () => { Files.move(aside, system.database, StandardCopyOption.ATOMIC_MOVE); () }
  }

  private def brownOut(size: Int)(system: AlarmSystem): Unit = {
    val half = 2 to size / 2 + 1
    half.foreach(s => system.bench(s"off $s"))
    system.simulate(FireBench.Missed)
    half.foreach(s => system.bench(s"on $s"))
  }

  /** All of them, in the order of [[Fault.all]].
    *
    * @param cables
    *   as many as slaves, in a ring one more
    */
  def all(size: Int, cables: Int, random: Random): Seq[LineFault] = {
    val slave     = 1 + random.nextInt(size)
    val other     = 1 + (slave + random.nextInt(size - 1)) % size
    val Seq(a, b) = random.shuffle((1 to cables).toList).take(2).sorted
    def server(fails: AlarmSystem => Unit): AlarmSystem => () => Unit = { system =>
      fails(system)
      () => {
        system.stopServer()
        system.restartServer()
      }
    }
    Seq(
      LineFault("server down", server(_.stopServer()), hidesPage = true),
      LineFault("server refuses", server(_.replaceServer()), hidesPage = true),
      LineFault(
        "log locked",
        { system =>
          val lock = system.lockLog()
          () => lock.close()
        },
        shown = OnPage
      ),
      LineFault("disk full", noDisk, shown = OnPage),
      LineFault("cable cut", during(s"cut $a")(s"mend $a"), shown = AtPanel),
      LineFault("ring cut twice", during(s"cut $a", s"cut $b")(s"mend $b", s"mend $a"), shown = AtPanel),
      LineFault("slave dead", during(s"off $slave")(s"on $slave"), shown = AtPanel, restarts = true),
      LineFault("host dead", during(s"host $slave stop")(s"host $slave start"), shown = AtPanel),
      LineFault("host slow", slowHost(slave), shown = AtPanel, restarts = true),
      LineFault(
        "host restarting",
        _ => () => (),
        again = system => Seq("stop", "start").foreach(how => system.bench(s"host $other $how"))
      ),
      LineFault(
        "chatter at 1 kHz",
        during(s"chatter $slave 20000 open")(s"chatter $slave off"),
        shown = AtPanel
      ),
      LineFault("equal IDs", renamed(slave -> other), shown = AtPanel, restarts = true),
      LineFault(
        "swapped slaves",
        renamed(slave -> other, other -> slave),
        shown = AtPanel,
        restarts = true
      ),
      // Each state lasts just long enough to be an event.
      LineFault(
        "queue full",
        during(s"chatter $slave 2500 open", s"chatter $other 2200 open")(
          s"chatter $slave off",
          s"chatter $other off"
        )
      ),
      LineFault("master restarted", _ => () => (), again = _.bench("restart master 2000")),
      LineFault("brown-out of half the line", _ => () => (), again = brownOut(size), restarts = true),
      LineFault("bit errors 1 in 10,000", during("noise all 10000")("noise all off")),
      LineFault(
        "forged traffic at wire speed",
        { system =>
          val flood = system.attacker.flood()
          () => flood.close()
        }
      )
    )
  }

  /** Faults alone, and pairs: by their numbers in [[all]]. Each is in two pairs, every other one of which is
    * in a ring.
    */
  def plans: Seq[(Seq[Int], Boolean)] = {
    val faults = Fault.all.indices
    val sets   = faults.map(i => Seq(i, (i + 5) % faults.size)) ++ faults.map(Seq(_))
    for ((set, n) <- sets.zipWithIndex)
      yield set -> (n % 2 == 1 || set.exists(i => Fault.all(i).ring.contains(true)))
  }
}
