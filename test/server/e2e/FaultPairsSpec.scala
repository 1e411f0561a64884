package flyframe.e2e

import scala.util.Random
import flyframe.Tier
import flyframe.protocol.{DetectorState, EventKind}
import flyframe.system.Fault
import FireBench._
import LineFault.{AtPanel, OnPage}

/** Issue 12, must-show 2, in RTL with host programs and real server: faults and pairs of faults, then fire at
  * each of five positions, then the end of the faults. The model has all of them
  * ([[flyframe.system.FaultMatrixSpec]]).
  */
abstract class FaultPairs(isRing: Boolean)
    extends FireBench(
      if (isRing) "faults-ring" else "faults-line",
      Seq("--slaves", "5", "--debounce-us", "200") ++ Option.when(isRing)("--ring"),
      mayMiss = true
    ) {
  private val Size  = 5
  private val where = if (isRing) "in a ring" else "on a line"
  private val mine  = LineFault.plans.zipWithIndex.filter(_._1._2 == isRing)
  private val tier =
    Tier(
      s"faults and pairs of faults $where in RTL, then fire at each of 5 slaves",
      "plans",
      2,
      mine.size.toLong
    )

  for (((numbers, _), seed) <- mine.indices.by(mine.size / tier.size.toInt).map(mine)) {
    val random = new Random(seed)
    val all    = LineFault.all(Size, if (isRing) Size + 1 else Size, random)
    val name   = numbers.map(all(_).name).mkString(" and ")
    s"Fires $where with $name" should "sound, be shown and be logged" in
      tier.run(name, 1, Some(seed.toLong))(row(burn(_, numbers.map(all), random)))
  }

  "The list of faults" should "be that of the model" in
    assert(LineFault.all(Size, Size, new Random(1)).map(_.name) == Fault.all.map(_.name))

  private def burn(system: AlarmSystem, faults: Seq[LineFault], random: Random): Unit = {
    val before = records(system)
    val ends   = faults.map(_.begin(system))
    val isSeen = !faults.exists(_.hidesPage)
    for (f <- faults) {
      if (f.shown == AtPanel) system.within(Displayed, s"the fault ${f.name}")(system.master("fault").bool)
      if (f.shown == OnPage && isSeen)
        system.await(s"the notice ${f.name}")(!system.picture.get("broken").isNull)
    }
    val order = random.shuffle((1 to Size).toList)
    for (slave <- order) {
      val isBefore = random.nextBoolean()
      if (isBefore) faults.foreach(_.again(system))
      system.bench(s"smoke $slave on")
      if (!isBefore) faults.foreach(_.again(system))
      isHeard(system, slave, isSeen)
      if (slave != order.last) {
        system.bench(s"smoke $slave off")
        isQuiet(system)
      }
    }
    // The last one burns on.
    ends.reverse.foreach(_())
    burns(system, order.last)
    isLogged(system, before, order, faults.exists(_.restarts))
  }

  /** It sounds by itself if it has power, and at the master if that can know of it. */
  private def isHeard(system: AlarmSystem, slave: Int, isSeen: Boolean): Unit = {
    system.within(Soon, s"sounders and fire output at smoke at slave $slave") {
      val status = system.status
      val here   = status("slaves")(slave - 1)
      !here("powered").bool || here("buzzer").bool && here("lamp").bool &&
      (!reaches(status, slave) || status("master")("sounder").bool && status("master")("fire").bool)
    }
    if (isSeen && reaches(system.status, slave))
      system.await(s"the fire at slave $slave on the page")(stateOf(system, slave) == "alarm")
  }

  /** There is a way from the master to this slave, which has power. */
  private def reaches(status: ujson.Value, slave: Int): Boolean = {
    val cables  = status("cables").arr.map(_.str == "whole")
    val powered = status("slaves").arr.map(_("powered").bool)
    def way(cables: Iterable[Boolean], slaves: Iterable[Boolean]) = (cables ++ slaves).forall(identity)
    way(cables.take(slave), powered.take(slave)) || isRing &&
    way(cables.drop(slave), powered.drop(slave - 1))
  }

  /** Somebody presses reset, again and again: no fire is left that the master could know of. */
  private def isQuiet(system: AlarmSystem): Unit = {
    var pressed = 0.0
    system.await("all is quiet after a reset") {
      val status = system.status
      val master = status("master")
      val isOver = master("powered").bool && !master("sounder").bool && !master("fire").bool &&
        (1 to Size).forall(s => !reaches(status, s) || !status("slaves")(s - 1)("lamp").bool)
      if (!isOver && status("time_us").num > pressed + Pressed) {
        pressed = status("time_us").num
        system.bench("press reset")
      }
      isOver
    }
  }

  /** Between two presses of a button, us. */
  private val Pressed = 12000.0

  private def records(system: AlarmSystem) = system.log.filter(_.kind == EventKind.Detector)

  /** Each fire is in the log, or records are counted as missing; none is there twice. */
  private def isLogged(
      system: AlarmSystem,
      before: Seq[Logged],
      slaves: Seq[Int],
      restarted: Boolean
  ): Unit = {
    def isThere(slave: Int) = records(system)
      .drop(before.size)
      .exists(e => e.position == slave - 1 && e.state == DetectorState.Alarm)
    def isMissed(slave: Int) = entry(system, slave)("notes").arr.exists(_.str.contains("missing in the log"))
    // Records that a slave has lost with its power are no gap.
    for (slave <- if (restarted) slaves.takeRight(1) else slaves)
      system.await(s"the fire at slave $slave in the log")(isThere(slave) || isMissed(slave))
    // Before its host has started a slave may tell the same as after the start before.
    val found = records(system).drop(before.size).filter(_.epoch != 0)
    val keys  = found.map(e => (e.position, e.node, e.sequence, e.state, e.epoch, e.slaveTime))
    assert(keys.distinct.size == keys.size, found.mkString("\n"))
  }
}

/** See [[FaultPairs]]. */
class FaultPairsSpec     extends FaultPairs(isRing = false)
class FaultPairsRingSpec extends FaultPairs(isRing = true)
