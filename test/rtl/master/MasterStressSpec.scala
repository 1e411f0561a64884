package flyframe.master

import scala.util.Random
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{SharedSimulation, Tier}
import flyframe.protocol.Command.Bwr
import flyframe.protocol.EventKind

/** The master with 64 modelled slaves and a modelled server, when much goes wrong: every event arrives once,
  * those of a slave in order.
  */
class MasterStressSpec extends AnyFlatSpec with SharedSimulation {
  private val slaves   = AlarmLatency.Slaves
  private val busCycle = 2500 // 100 us
  private val Seed     = 1L

  private val noise =
    Tier(
      "64 slaves, one bit in 10,000 in error, reports lost, a host that sends",
      "rounds",
      test = 3,
      soak = 100
    )
  private val latency =
    Tier("64 slaves, from a detector to the report in time", "events", test = 40, soak = 2000)

  /** A started line, and what happens at its detectors. */
  private class Scene(dut: RecordedMaster) {
    val random        = new Random(Seed)
    val line          = new TimedLine(1 to slaves)
    val server        = new ServerModel(SystemDriver.MasterId)
    val driver        = new SystemDriver(dut, line, server, busCycle)
    private var moves = Vector.fill(slaves)(Vector(1)) // the states each detector has been in
    driver.start(1)
    driver.settle()

    /** Some detectors change their state, all at the same time. */
    def change(which: Seq[Int]): Unit = which.foreach { slave =>
      val state = moves(slave).last % 4 + 1
      moves = moves.updated(slave, moves(slave) :+ state)
      line.move(slave, state, driver.slot.toDouble)
    }
    def changeAll(): Unit = change(0 until slaves)

    /** After all that: each event is in the log once, those of a slave in order. A master that has been
      * restarted may tell the last ones again, by the same numbers.
      */
    def check(): Unit = {
      driver.settle()
      val events = server.log.filter(_.kind == EventKind.Detector)
      for ((boot, mine) <- events.groupBy(_.boot))
        assert(mine.distinctBy(e => (e.node, e.sequence)).size == mine.size, s"doubled in boot $boot")
      val told = events.distinctBy(e => (e.node, e.epoch, e.sequence)).groupBy(_.node)
      for ((states, slave) <- moves.zipWithIndex) {
        val mine = told.getOrElse(slave + 1, Nil)
        assert(mine.map(_.sequence) == (1 to states.size), s"slave $slave")
        assert(mine.map(_.state) == states, s"slave $slave")
        assert(mine.forall(e => e.position == slave && e.epoch == TimedLine.Epoch))
      }
    }
  }

  together("64 slaves", new RecordedMaster(AlarmLatency.parameters))(
    "LM-05, LM-06, REP-02: all slaves change in the same cycle, faster than they are read" -> { dut =>
      val scene = new Scene(dut)
      for (_ <- 1 to 4) {
        scene.changeAll()
        scene.driver.cycles(3)
      }
      assert(scene.line.waiting > 200)
      scene.check()
      assert(dut.buzzer.peek().litToBoolean)
    },
    "LM-06, LM-07, REP-03: bits in error, one in 10,000, lost reports, and a host that sends" -> { dut =>
      val scene = new Scene(dut)
      scene.line.errorRate = 1e-4
      scene.driver.lossPercent = 10
      noise.run("all", noise.size, Some(Seed)) {
        for (round <- 1 to noise.size.toInt) {
          scene.changeAll()
          val answer = scene.driver.request(Bwr, 0x0e90L << 16, 1 to 8)
          assert(answer.forall(_ == slaves), s"round $round")
          scene.driver.cycles(40)
        }
        scene.check()
      }
      assert(scene.line.damaged > 5)
    },
    "LM-03: a cable cut before slave 3, and mended" -> { dut =>
      val scene = new Scene(dut)
      scene.changeAll()
      scene.driver.cycles(4)
      scene.line.setCable(3, intact = false)
      scene.changeAll()
      scene.driver.cycles(60)
      scene.changeAll()
      scene.driver.cycles(30)
      assert(scene.driver.read(0x0040) == 3)
      scene.line.setCable(3, intact = true)
      scene.check()
      for (kind <- Seq(EventKind.Lost, EventKind.Found))
        assert(scene.server.log.filter(_.kind == kind).map(_.position) == (3 until slaves))
    },
    "LM-09, REP-06: the server is down while more happens than the master can keep" -> { dut =>
      val scene = new Scene(dut)
      scene.server.down = true
      for (_ <- 1 to 4) {
        scene.changeAll()
        scene.driver.cycles(50)
      }
      assert(scene.line.waiting > 0, "the master is full, events wait at the slaves")
      scene.driver.cycles(200)
      scene.server.down = false
      scene.check()
    },
    "ALARM-03, ALARM-04: a master that is started again, in the middle of it all" -> { dut =>
      val scene = new Scene(dut)
      for (boot <- 2 to 4) {
        scene.changeAll()
        scene.driver.cycles(1 + scene.random.nextInt(12))
        scene.driver.start(boot)
      }
      scene.check()
    },
    "REP-03: from a detector to the report in less than two bus cycles and 10 us" -> { dut =>
      val times = latency.run("all", latency.size, Some(Seed)) {
        AlarmLatency.measure(dut, latency.size.toInt, busCycle = 5000, Seed)
      }
      info(times.json)
      assert(times.first.size == latency.size && times.first.max <= times.goal)
    }
  )
}
