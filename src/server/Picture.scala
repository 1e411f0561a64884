package flyframe.server

import flyframe.protocol.{DetectorState, SelfTest}

/** What the page shows, but for the log. */
final case class Picture(
    masters: Vector[Picture.Seen],
    refused: Seq[(String, Long)],
    commands: Boolean,
    broken: Option[String]
) {
  import Picture._

  def json: ujson.Obj = ujson.Obj(
    "masters"  -> masters.map(_.json),
    "refused"  -> ujson.Obj.from(refused.map { case (name, n) => name -> ujson.Num(n.toDouble) }),
    "commands" -> commands,
    "broken"   -> text(broken)
  )
}

object Picture {
  private def text(t: Option[String]): ujson.Value = t.fold[ujson.Value](ujson.Null)(ujson.Str(_))

  /** A master, whether it is silent, and its last commands. */
  final case class Seen(master: Master, silent: Boolean, orders: Seq[Order]) {
    private def line = master.line
    private def last = master.last

    def json: ujson.Obj = ujson.Obj(
      "id"         -> master.life.master,
      "boot"       -> master.life.boot,
      "silent"     -> silent,
      "heard"      -> text(master.address.map(_ => master.heard.toString)),
      "selfTest"   -> EventText.selfTest(last.selfTest),
      "present"    -> last.present,
      "known"      -> last.known,
      "framesLost" -> last.lost.toDouble,
      "alarms"     -> line.alarms.map(i => ujson.Str(LineState.label(i))),
      "cut"        -> cut.fold[ujson.Value](ujson.Null)(ujson.Num(_)),
      "notices"    -> notices.map(ujson.Str(_)),
      "slaves"     -> line.slaves.indices.map(slave),
      "orders" -> orders.map { o =>
        ujson.Obj(
          "id"   -> o.id,
          "text" -> EventText.command(o.code, o.node),
          "state" -> o.outcome
            .fold(if (o.counter.isEmpty) "waiting" else "sent")(_.fold(_ => "failed", _ => "done")),
          "reason" -> text(o.outcome.flatMap(_.left.toOption))
        )
      }
    )

    /** Position of the first slave that is lost, if all before it answer: there the line is cut. */
    private def cut: Option[Int] = Some(line.slaves.indexWhere(!_.answers)).filter(i => i >= 0 && !silent)

    private def notices: Seq[String] = Seq(
      Option.when(silent)("This master does not report. Nothing is known of its detectors."),
      Option.when(last.selfTest > SelfTest.Good)(s"Master: ${EventText.selfTest(last.selfTest)}."),
      Option.when(line.beyond > 0)(
        s"The line has ${line.beyond} slaves more than this master can list. They are not watched."
      ),
      master.missing.map { case (from, to) =>
        s"Events $from to $to are not in this log, and the master has them no more. Restart the master."
      }
    ).flatten

    private def slave(position: Int): ujson.Obj = {
      val s             = line.slaves(position)
      val (state, what) = stateOf(position)
      ujson.Obj(
        "label" -> LineState.label(position),
        "node"  -> s.node,
        "state" -> state,
        "text"  -> what,
        "notes" -> notes(position, state).map(ujson.Str(_)),
        "twin"  -> s.twin.nonEmpty
      )
    }

    /** normal, alarm, fault, lost or unknown, and the same in words. An alarm hides every fault. */
    private def stateOf(position: Int): (String, String) = {
      val s = line.slaves(position)
      (line.detector(position), s) match {
        case _ if silent                              => ("unknown", "unknown")
        case _ if !s.answers                          => ("lost", "lost")
        case (Some(DetectorState.Alarm), _)           => ("alarm", "alarm")
        case (_, Slave(_, _, _, _, _, Some(twin), _)) => ("fault", s"same ID as ${LineState.label(twin)}")
        case (_, _) if s.selfTest > SelfTest.Good     => ("fault", EventText.selfTest(s.selfTest))
        case (Some(d @ (DetectorState.Open | DetectorState.Short)), _) => ("fault", EventText.detector(d))
        case (Some(DetectorState.Normal), _)                           => ("normal", "normal")
        case (Some(d), _)                                              => ("unknown", EventText.detector(d))
        case (None, _)                                                 => ("unknown", "nothing told yet")
      }
    }

    private def notes(position: Int, state: String): Seq[String] = {
      val s       = line.slaves(position)
      val notLive = state == "lost" || silent
      Seq(
        line.detector(position).filter(_ => notLive).map(d => s"before: ${EventText.detector(d)}"),
        Option.when(s.selfTest == SelfTest.NotRun)(EventText.selfTest(SelfTest.NotRun)),
        s.before.map(b => s"follows ID $b")
      ).flatten
    }
  }

  /** An entry of the log. */
  def json(e: LogEntry): ujson.Obj = ujson.Obj(
    "id"       -> e.id.toDouble,
    "received" -> e.received.toString,
    "master"   -> e.life.master,
    "label"    -> EventText.label(e.event),
    "node"     -> EventText.node(e.event).fold[ujson.Value](ujson.Null)(ujson.Num(_)),
    "severity" -> EventText.severity(e.event),
    "text"     -> EventText.text(e.event)
  )
}
