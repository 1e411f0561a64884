package flyframe.master

import scala.util.Random
import chiseltest._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{SharedSimulation, Tier}
import flyframe.protocol.Command.Bwr
import flyframe.protocol.{EventKind, SlaveStatus}

/** The master with 64 modelled slaves and a modelled server, when much goes wrong: every record arrives once,
  * and alarms sound whatever happens to the records.
  */
class MasterStressSpec extends AnyFlatSpec with SharedSimulation {
  private val slaves   = AlarmLatency.Slaves
  private val busCycle = 2500 // 100 us
  private val Seed     = 1L

  private val noise =
    Tier(
      "64 slaves, one bit in 10,000 in error, reports lost, a host that sends",
      "rounds",
      test = 1,
      soak = 100
    )
  private val latency =
    Tier("64 slaves, from a detector to the report in time", "events", test = 4, soak = 1000)

  /** A started line, and what happens at its detectors. */
  private class Scene(dut: RecordedMaster) {
    val random        = new Random(Seed)
    val line          = new TimedLine((1 to slaves).map(TimedLine.started(_)))
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

    def sounds: Boolean = dut.alarm.sounder.peekBoolean()
    def fire: Boolean   = dut.alarm.fire.peekBoolean()
    def silence(): Unit = driver.write(0x003c, 0x17)

    /** After all that: each record is in the log once, and none is missing. A master that has been restarted
      * may tell the last ones again, by the same numbers; so it does with those of slaves that were absent,
      * of which the server sees that they are the same (SRV-19).
      */
    def check(again: Boolean = false): Unit = {
      driver.settle()
      val records = server.log.filter(_.kind == EventKind.Detector)
      for ((life, mine) <- records.groupBy(_.life))
        for (same <- mine.groupBy(e => (e.node, e.sequence)).values)
          assert(
            same.size == 1 || again && same.size == 2 && same
              .map(_.copy(number = 0, masterTime = 0))
              .distinct
              .size == 1,
            s"life $life"
          )
      val told = records.distinctBy(e => (e.node, e.epoch, e.sequence)).groupBy(_.node)
      for ((states, slave) <- moves.zipWithIndex) {
        val mine = told.getOrElse(slave + 1, Nil).sortBy(_.sequence)
        assert(mine.map(_.sequence) == (1 to states.size), s"slave $slave")
        assert(mine.map(_.state) == states, s"slave $slave")
        assert(mine.forall(e => e.position == slave && e.epoch == TimedLine.Epoch))
      }
      val shown = server.last.slaves
      assert(shown.map(_._2) == (1 to slaves) && shown.forall(s => (s._1 & SlaveStatus.Absent) == 0))
      for ((states, slave) <- moves.zipWithIndex; is = shown(slave)._1) {
        assert(((is & SlaveStatus.Alarm) != 0) == (states.last == 2), s"slave $slave")
        assert(((is & SlaveStatus.Latched) != 0) == states.contains(2), s"slave $slave")
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
      assert(scene.sounds && scene.fire)
      scene.check()
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
    "LM-05, LM-11: a cable cut before slave 3, and mended" -> { dut =>
      val scene = new Scene(dut)
      scene.changeAll()
      scene.driver.cycles(4)
      scene.line.setCable(3, intact = false)
      scene.changeAll()
      scene.driver.cycles(60)
      scene.changeAll()
      scene.driver.cycles(30)
      assert(scene.driver.read(0x0040) == 3 && dut.alarm.fault_n.peekBoolean() == false)
      scene.line.setCable(3, intact = true)
      scene.check(again = true)
      val absent =
        scene.server.log.filter(e => e.kind == EventKind.Slave && (e.sequence & SlaveStatus.Absent) != 0)
      assert(absent.map(_.position).distinct.sorted == (3 until slaves))
    },
    "LM-06, LM-08, REP-06: the server is down while more happens than the master can keep" -> { dut =>
      val scene = new Scene(dut)
      scene.server.down = true
      for (_ <- 1 to 4) {
        scene.changeAll()
        scene.driver.cycles(50)
      }
      assert(scene.line.waiting > 0, "the master is full, records wait at the slaves")
      assert(scene.sounds && scene.fire)
      scene.silence()
      scene.driver.cycles(200)
      assert(!scene.sounds && scene.fire)
      scene.change(Seq(slaves - 1)) // smoke at the last one
      scene.driver.cycles(40)
      assert(scene.sounds)
      scene.server.down = false
      scene.check()
    },
    "ALARM-03, ALARM-04: a master that is started again, in the middle of it all" -> { dut =>
      val scene = new Scene(dut)
      for (life <- 2 to 4) {
        scene.changeAll()
        scene.driver.cycles(1 + scene.random.nextInt(12))
        scene.driver.start(life)
      }
      scene.check()
    },
    "LM-05, REP-03: from a detector to sounder and report in less than two bus cycles and 10 us" -> { dut =>
      val times = latency.run("all", latency.size, Some(Seed)) {
        AlarmLatency.measure(dut, latency.size.toInt, busCycle = 5000, Seed)
      }
      info(times.json)
      for (all <- Seq(times.sounder, times.first))
        assert(all.size == latency.size && all.max <= times.goal && all.min > 0)
    }
  )
}
