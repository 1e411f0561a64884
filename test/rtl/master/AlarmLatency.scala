package flyframe.master

import java.nio.file.{Files, Path, Paths}
import scala.collection.mutable
import scala.util.Random
import chiseltest.RawTester
import flyframe.Simulation
import flyframe.params.Presets

/** Times from detectors to the report that tells the server, us.
  *
  * @param first
  *   until its first nibble leaves; `last`: its last one
  */
final case class AlarmTimes(slaves: Int, busCycleUs: Double, first: Seq[Double], last: Seq[Double]) {

  /** What is promised for the report to leave: two bus cycles and 10 us. */
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
        "to_first_nibble_us" -> spread(first),
        "to_last_nibble_us"  -> spread(last)
      ),
      indent = 2
    )
  }
}

/** Measures how long an event takes from the pins of a detector to the server's cable: the master in RTL, 64
  * slaves in the model with the times of the real ones, no debounce, events one after the other at random
  * times at random slaves.
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
      new SystemDriver(dut, new TimedLine(1 to Slaves), new ServerModel(SystemDriver.MasterId), busCycle)
    driver.start(1)
    driver.settle()

    val started = mutable.Map.empty[(Int, Int), Long] // by node and number: when it happened
    val times   = mutable.ArrayBuffer.empty[(Double, Double)]
    val states  = Array.fill(Slaves)(1)
    val numbers = Array.fill(Slaves)(1)               // that of the state at the start
    driver.onReport = (first, last, data) =>
      for (e <- driver.server.parse(data); at <- started.remove((e.node, e.sequence)))
        times += (((first - at) * 0.04, (last - at) * 0.04))
    for (_ <- 1 to events) {
      val slave = random.nextInt(Slaves)
      val at    = driver.slot + random.nextInt(busCycle)
      states(slave) = if (states(slave) == 1) 2 else 1
      numbers(slave) += 1
      started((slave + 1, numbers(slave))) = at
      driver.line.move(slave, states(slave), at.toDouble)
      driver.run(3L * busCycle + random.nextInt(3 * busCycle))
    }
    driver.settle()
    require(started.isEmpty && times.size == events, s"${started.size} events have not been reported")
    AlarmTimes(Slaves, busCycle * 0.04, times.map(_._1).toSeq, times.map(_._2).toSeq)
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
