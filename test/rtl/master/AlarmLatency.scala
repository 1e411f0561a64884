package flyframe.master

import java.nio.file.{Files, Path, Paths}
import scala.collection.mutable
import scala.util.Random
import chiseltest._
import flyframe.Simulation
import flyframe.params.Presets
import flyframe.protocol.EventKind

/** Times from detectors to the master's sounder, and to the report that tells the server, us.
  *
  * @param sounder
  *   until it is on
  * @param first
  *   until the first nibble of the report leaves; `last`: its last one
  */
final case class AlarmTimes(
    slaves: Int,
    busCycleUs: Double,
    sounder: Seq[Double],
    first: Seq[Double],
    last: Seq[Double]
) {

  /** What is promised for the sounder, and for the report to leave: two bus cycles and 10 us. */
  def goal: Double = 2 * busCycleUs + 10

  /** As `flyframe-alarm --measure` prints it. */
  def json: String = {
    def us(v: Double) = math.round(v * 100) / 100.0
    def spread(times: Seq[Double]) = {
      val sorted = times.sorted
      ujson.Obj(
        "best"   -> us(sorted.head),
        "median" -> us(sorted(sorted.size / 2)),
        "worst"  -> us(sorted.last)
      )
    }
    ujson.write(
      ujson.Obj(
        "slaves"             -> slaves,
        "bus_cycle_us"       -> busCycleUs,
        "events"             -> first.size,
        "goal_us"            -> goal,
        "to_sounder_us"      -> spread(sounder),
        "to_first_nibble_us" -> spread(first),
        "to_last_nibble_us"  -> spread(last)
      ),
      indent = 2
    )
  }
}

/** Measures how long an event takes from the pins of a detector to the master's sounder and to the server's
  * cable: the master in RTL, 64 slaves in the model with the times of the real ones, no debounce, events one
  * after the other at random times at random slaves.
  *
  * {{{sbt "Test / runMain flyframe.master.AlarmLatency 1000 build/alarm-latency.json"}}}
  */
object AlarmLatency {
  val Slaves     = 64
  val parameters = Presets.master.copy(coreClockMhz = 50)

  /** @param busCycle
    *   slots of 40 ns
    */
  def measure(dut: RecordedMaster, events: Int, busCycle: Int, seed: Long = 1): AlarmTimes = {
    val random = new Random(seed)
    val driver =
      new SystemDriver(
        dut,
        new TimedLine((1 to Slaves).map(TimedLine.started(_))),
        new ServerModel(SystemDriver.MasterId),
        busCycle
      )
    driver.start(1)
    driver.settle()

    val started = mutable.Map.empty[(Int, Int), Long] // by node and number: when it happened
    val times   = mutable.ArrayBuffer.empty[(Double, Double)]
    val numbers = Array.fill(Slaves)(1)               // that of the state at the start
    driver.onReport = (first, last, data) =>
      for (
        e  <- driver.server.parse(data).events if e.kind == EventKind.Detector;
        at <- started.remove((e.node, e.sequence))
      )
        times += (((first - at) * 0.04, (last - at) * 0.04))
    def sounds = dut.alarm.sounder.peekBoolean()
    val sounder = for (i <- 1 to events) yield {
      require(!sounds, s"alarm $i: it sounds before")
      val slave = random.nextInt(Slaves)
      val at    = driver.slot + random.nextInt(busCycle)
      numbers(slave) += 1
      started((slave + 1, numbers(slave))) = at
      driver.line.move(slave, 2, at.toDouble)
      // Until the master has read the states of all slaves: it knows whom to silence.
      driver.run((Slaves / 4 + 3L) * busCycle)
      require(sounds, s"alarm $i: it does not sound")
      val time = (dut.soundedAt.peekInt().toLong - at) * 0.04
      driver.write(0x003c, 0x17)
      numbers(slave) += 1
      driver.line.move(slave, 1, driver.slot.toDouble)
      // Longer than what follows is told: reports are one per millisecond then.
      driver.run(40L * busCycle + random.nextInt(3 * busCycle))
      time
    }
    driver.settle()
    require(started.isEmpty && times.size == events, s"${started.size} events have not been reported")
    AlarmTimes(Slaves, busCycle * 0.04, sounder, times.map(_._1).toSeq, times.map(_._2).toSeq)
  }

  /** Arguments: number of events (1000), file (standard output), bus cycle in us (200). */
  def main(args: Array[String]): Unit = {
    val events   = args.lift(0).fold(1000)(_.toInt)
    val busCycle = args.lift(2).fold(200)(_.toInt) * 25
    RawTester.test(new RecordedMaster(parameters), Simulation.annotations(this, "measured")) { dut =>
      val json = measure(dut, events, busCycle).json
      args.lift(1) match {
        case Some(file) => write(Paths.get(file), json)
        case None       => println(json)
      }
    }
  }
  private def write(file: Path, text: String): Unit = {
    Option(file.getParent).foreach(Files.createDirectories(_))
    Files.writeString(file, text + "\n")
  }
}
