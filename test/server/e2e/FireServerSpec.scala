package flyframe.e2e

import java.nio.file.Files
import java.sql.DriverManager
import scala.util.Using
import flyframe.protocol.AnswerLayout
import flyframe.server.Protocol
import FireBench._

/** The table of issue 12, the rows about server and wire: what fails first, then a fire. See [[FireBench]];
  * the others are in [[FireSpec]].
  */
class FireServerSpec extends FireBench("fire-server") {
  "LM-02, LM-12: the first plug opened and closed 19 times while the server is down" should "stop nothing" in
    row { system =>
      system.stopServer()
      for (_ <- 1 to 19; what <- Seq("cut 1", "mend 1")) {
        system.bench(what)
        system.simulate(Missed)
      }
      system.within(Displayed, "the master's memory is full")(isFull(system))
      isFault(system, "Server takes nothing")
      isLogged(system, 3, 1) {
        fire(system, 3, isShown = false)
        system.restartServer()
        burns(system, 3)
      }
    }

  "ALARM-05: 16 changes of a loose contact while the server is down" should "leave room for the fire" in
    row { system =>
      system.stopServer()
      val before = records(system, 1).size
      for (_ <- 1 to 10; what <- Seq("line 1 open", "line 1 whole")) {
        system.bench(what)
        system.simulate(600)
      }
      isLogged(system, 1, 1) {
        fire(system, 1, isShown = false)
        system.restartServer()
        burns(system, 1)
      }
      assert(numbers(system, 1).distinct.size == before + 21)
    }

  /** Of a slave's records in its present epoch. */
  private def numbers(system: AlarmSystem, slave: Int) =
    records(system, slave).map(e => (e.epoch, e.sequence))

  "REP-06, LM-09: 128 events that wait for the server" should "hide no fire, and hold no silence" in
    row { system =>
      system.stopServer()
      val before = records(system, 3).size
      // 64 are changes of states, 56 are records; further ones wait at their slaves.
      for (_ <- 1 to 12; what <- Seq("line all open", "line all whole")) {
        system.bench(what)
        system.simulate(600)
      }
      assert(isFull(system))
      isLogged(system, 1, 1) {
        isLogged(system, 3, 1) {
          fire(system, 3, isShown = false)
          silence(system)
          fire(system, 1, isShown = false)
          silence(system)
          system.restartServer()
          system.await("both are on the page")(Seq(1, 3).forall(stateOf(system, _) == "alarm"))
        }
      }
      assert(numbers(system, 3).distinct.size == before + 25)
    }

  "SRV-04, SRV-11: spoofed reports" should "use up no number" in row { system =>
    val genuine  = system.attacker.report.get
    val heard    = Protocol.report(genuine).get
    val wrongKey = Array.fill[Byte](16)(0x5a)
    for (n <- 1 to 64) {
      val spoofed =
        heard.copy(counter = heard.counter + 1000 + n, first = heard.first + n, slaves = Vector.empty)
      system.attacker.toServer(Protocol.encode(spoofed, wrongKey))
      system.attacker.toServer(genuine)
    }
    system.await("they are refused")(refused(system, "forged") >= 64 && refused(system, "replayed") >= 64)
    assert(system.shown.get("slaves").arr.size == 3)
    isLogged(system, 2, 1)(fire(system, 2))
  }

  private def refused(system: AlarmSystem, why: String) = system.picture.get("refused")(why).num

  "SRV-01, SRV-03: forged and old acknowledgements, from any port" should "delete no event" in row { system =>
    val old = system.attacker.answer.get
    system.attacker.passes = false
    isLogged(system, 2, 1) {
      fire(system, 2, isShown = false)
      def refusals = Protocol.report(system.attacker.report.get).get.refused
      val before   = refusals
      for (isServer <- Seq(true, false); n <- 1 to 12) {
        val forged = old.clone
        val echo   = AnswerLayout.Echo.offset
        forged(echo) = (forged(echo) + 1).toByte
        forged(AnswerLayout.Number.offset + 2) = n.toByte
        system.attacker.toMaster(forged, isServer)
        system.attacker.toMaster(old, isServer)
      }
      // From the server's port all count as refused, from another one too.
      system.await("they are refused")(refusals - before >= 24)
      system.attacker.passes = true
      burns(system, 2)
    }
  }

  "HOST-13, SRV-10: a master whose boot number comes again" should "be a new one; nothing is lost" in
    row { system =>
      val lives = system.log.map(_.life).distinct.size
      system.stopServer()
      isLogged(system, 2, 1) {
        fire(system, 2, isShown = false)
        system.bench("off master")
        val boot = Files.readString(system.folder.resolve("state/master")).trim
        remember(system, "master", boot.toLong - 1)
        system.bench("on master")
        burns(system, 2, isShown = false)
        assert(system.master("line_life").num == boot.toDouble)
        system.restartServer()
        burns(system, 2)
      }
      assert(system.log.map(_.life).distinct.size == lives + 1)
    }

  "SRV-06: a database that is lost while the master runs" should "be a gap, and the fire is shown" in
    row { system =>
      system.stopServer()
      for (file <- Seq("log.db", "log.db-wal", "log.db-shm"))
        Files.deleteIfExists(system.folder.resolve(file))
      system.restartServer()
      isLogged(system, 2, 1)(fire(system, 2))
      system.await("the gap is shown")(
        system.shown.get("notices").arr.exists(_.str.contains("are not in this log"))
      )
      system.bench("restart master") // another life has no gap
      system.await("it has no power")(!system.master("powered").bool)
    }

  "SRV-22: a log that cannot be written" should "hide no fire; the master is not silent" in row { system =>
    isLogged(system, 2, 1) {
      Using.resource(system.lockLog()) { _ =>
        fire(system, 2)
        system.await("it is said")(!system.picture.get("broken").isNull)
        system.await("the master is told")(system.attacker.answer.get(AnswerLayout.Trouble.offset) == 1)
        silence(system)
        fire(system, 3)
        assert(!system.shown.get("silent").bool && alarms(system, 3) == 0)
      }
    }
  }

  "SRV-24: a server whose log has times of the future" should "show and log a fire at once" in row { system =>
    system.stopServer()
    Using.resource(DriverManager.getConnection(s"jdbc:sqlite:${system.database}"))(
      _.createStatement.executeUpdate("update event set received = received + 5000000") // 83 minutes
    )
    system.restartServer()
    isLogged(system, 2, 1)(fire(system, 2))
    assert(refused(system, "replayed") == 0)
  }
}
