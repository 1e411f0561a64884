package flyframe.e2e

import java.nio.file.{Files, Path}
import org.scalatest.BeforeAndAfterAll
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.{DetectorState, EventKind, MasterStatus}
import flyframe.server.Protocol

/** A system that fails in part, and then has a fire: a master and slaves in RTL with their host programs, a
  * real server with its log, somebody on the wire between them.
  *
  * @param name
  *   of its folder
  * @param settings
  *   options of `flyframe-alarm` besides those that all have
  * @param mayMiss
  *   records may be missing in the log, if that is shown
  */
abstract class FireBench(
    name: String,
    settings: Seq[String] = Seq("--slaves", "3", "--debounce-us", "100"),
    mayMiss: Boolean = false
) extends AnyFlatSpec
    with BeforeAndAfterAll {
  import FireBench._
  private var made = Option.empty[AlarmSystem]

  /** One for all rows: each ends when all is well again. A row that has failed leaves none to the next one.
    */
  private def bench: AlarmSystem = made.getOrElse {
    val system = new AlarmSystem(name, Settings ++ settings, isAttacked = true)
    made = Some(system)
    isWell(system)
    system
  }
  override def afterAll(): Unit = made.foreach(_.close())

  protected def row(test: AlarmSystem => Unit): Unit = {
    val system = bench
    try {
      test(system)
      end(system)
    } catch {
      case e: Throwable =>
        made = None
        system.close()
        throw e
    }
  }

  /** Smoke: at once sounders, lamps, panel, and the page if there is a server. */
  protected def fire(system: AlarmSystem, slave: Int, isShown: Boolean = true): Unit = {
    system.bench(s"smoke $slave on")
    burns(system, slave, isShown)
  }

  protected def burns(system: AlarmSystem, slave: Int, isShown: Boolean = true): Unit = {
    system.within(Soon, s"sounders and fire output at smoke at slave $slave") {
      val status         = system.status
      val (master, here) = (status("master"), status("slaves")(slave - 1))
      master("sounder").bool && master("fire").bool && here("buzzer").bool && here("lamp").bool
    }
    system.within(Displayed, s"slave $slave on the panel") {
      val lines = display(system)
      val label = s" ${AlarmSystem.label(slave)} "
      lines.headOption.exists(_.startsWith("FIRE")) && lines.drop(1).exists(_.contains(label))
    }
    if (isShown) system.await(s"the fire at slave $slave on the page") {
      val page = system.shown.get
      page("slaves")(slave - 1)("state").str == "alarm" && !page("silent").bool &&
      page("fire").objOpt.exists(_("sounding").bool)
    }
  }

  /** The button: sounders are off, and nothing else. */
  protected def silence(system: AlarmSystem): Unit = {
    system.bench("press silence")
    system.within(Soon, "silence") {
      val status = system.status
      !status("master")("sounder").bool && status("slaves").arr.forall(!_("buzzer").bool)
    }
    assert(system.master("fire").bool)
    system.simulate(Released)
  }

  /** A fault is at the output, and these words are on one line of the panel. */
  protected def isFault(system: AlarmSystem, words: String*): Unit =
    system.within(Displayed, s"the fault $words")(
      system.master("fault").bool && display(system).exists(line => words.forall(line.contains))
    )

  protected def display(system: AlarmSystem): Seq[String] = system.master("display").arr.map(_.str).toSeq

  /** What the page says of a slave. */
  protected def stateOf(system: AlarmSystem, slave: Int): String    = entry(system, slave)("state").str
  protected def entry(system: AlarmSystem, slave: Int): ujson.Value = system.shown.get("slaves")(slave - 1)

  /** Records in the log, of a slave's detector. */
  protected def records(system: AlarmSystem, slave: Int): Seq[Logged] =
    system.log.filter(e => e.kind == EventKind.Detector && e.node == slave)
  protected def alarms(system: AlarmSystem, slave: Int): Int =
    records(system, slave).count(_.state == DetectorState.Alarm)

  /** The log gets so many alarms of this slave, none twice. */
  protected def isLogged(system: AlarmSystem, slave: Int, times: Int)(body: => Unit): Unit = {
    val before = alarms(system, slave)
    body
    system.await(s"$times alarms of slave $slave in the log")(alarms(system, slave) - before >= times)
    assert(alarms(system, slave) - before == times)
  }

  /** The fires are over, somebody resets: then all is well by itself. */
  private def end(system: AlarmSystem): Unit = {
    system.bench("smoke all off")
    reset(system)
    isWell(system)
  }

  /** The button, as soon as there is somebody who hears it. */
  protected def reset(system: AlarmSystem): Unit = {
    system.await("the master's host has started")(system.master.obj.get("self_test").exists(_.num != 0))
    system.simulate(Released)
    system.bench("press reset")
  }

  private def isWell(system: AlarmSystem): Unit = system.await("all is well") {
    val status = system.status
    val master = status("master")
    val page   = system.shown
    !Seq("fire", "fault", "sounder", "disabled").exists(master(_).bool) &&
    display(system).headOption.exists(_.startsWith("No alarm, no fault")) &&
    master("host").str == "running" &&
    status("slaves").arr.forall(s => !s("buzzer").bool && !s("lamp").bool && s("supply").bool) &&
    page.exists { p =>
      p("status").num == 0 && p("slaves").arr.size == system.size &&
      p("notices").arr.forall(n => mayMiss && n.str.startsWith("Alarm records are missing")) &&
      p("slaves").arr.forall(s => s("state").str == "normal" && s("status").num == 0)
    } && system.picture.get("broken").isNull &&
    // The log has all events.
    system.attacker.report.flatMap(Protocol.report).exists(_.events.isEmpty)
  }
}

object FireBench {

  /** Times are short, since simulated time is dear. */
  private val Settings = Seq("--bus-cycle-us", "200", "--answer-timeout-us", "50", "--retries", "1")

  /** A second is promised; times are shorter here, us. */
  val Soon = 50000.0

  /** A page of the display stands for 40 ms. */
  val Displayed = 200000.0

  /** A button is no longer pressed, and no longer counts as pressed. */
  private val Released = 6000.0

  /** Longer than four cycles without an answer. */
  val Missed = 2000.0

  /** A master does not take changes of states any more. */
  def isFull(system: AlarmSystem): Boolean = (system.master("status").num.toInt & MasterStatus.Full) != 0

  /** What the host of a node keeps in its memory. */
  def remember(system: AlarmSystem, node: String, number: Long): Path =
    Files.writeString(system.folder.resolve("state").resolve(node), s"$number\n")
}
