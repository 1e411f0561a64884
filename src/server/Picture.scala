package flyframe.server

import java.time.Instant
import flyframe.protocol.{MasterStatus, Order, SelfTest, SlaveStatus}

/** What the page shows, but for the log. */
final case class Picture(
    masters: Vector[Picture.Seen],
    refused: Seq[(String, Long)],
    broken: Option[String],
    rings: Vector[RingPicture] = Vector.empty
) {
  import Picture._

  def json: ujson.Obj = ujson.Obj(
    "masters" -> masters.map(_.json),
    "rings"   -> rings.map(_.json),
    "refused" -> ujson.Obj.from(refused.map { case (name, n) => name -> ujson.Num(n.toDouble) }),
    "broken"  -> text(broken)
  )
}

object Picture {
  private def text(t: Option[String]): ujson.Value    = t.fold[ujson.Value](ujson.Null)(ujson.Str(_))
  private def texts(t: Iterable[String]): ujson.Value = ujson.Arr.from(t.map(ujson.Str(_)))
  private def time(t: Option[Instant]): ujson.Value   = text(t.map(_.toString))
  private def list(labels: Iterable[String]): String  = labels.mkString(", ")
  private def count(n: Long, what: String): String    = s"$n $what${if (n == 1) "" else "s"}"
  private def range(first: Long, last: Long): String  = if (first == last) s"$first" else s"$first to $last"

  /** A master, and what is known of it.
    *
    * @param unproven
    *   its reports come, but do not count
    * @param orders
    *   the last ones
    * @param missing
    *   alarm records that the log does not have, by node ID
    * @param losesFrames
    *   more than whenever a cable is cut (SRV-26)
    */
  final case class Seen(
      master: Master,
      expected: Expected,
      silent: Boolean,
      unproven: Boolean,
      orders: Seq[Ticket],
      missing: Map[Int, Int],
      losesFrames: Boolean = false
  ) {
    private def line   = master.line
    private val wanted = expected.masters.get(master.id)
    private def slaves = line.slaves
    private val places = 0 until (slaves.size max wanted.fold(0)(_.size))

    private def label(position: Int): String = expected.label(master.id, position)
    private def zone(position: Int): String  = expected.slave(master.id, position).fold("")(_.zone)

    def json: ujson.Obj = ujson.Obj(
      "id"         -> master.id,
      "life"       -> text(master.life.map(_.hex)),
      "silent"     -> silent,
      "unproven"   -> unproven,
      "heard"      -> time(master.heard),
      "selfTest"   -> EventText.selfTest(line.selfTest),
      "status"     -> line.status,
      "signs"      -> texts(EventText.masterSigns.collect { case (bit, sign) if line.has(bit) => sign }),
      "present"    -> line.present,
      "known"      -> slaves.size,
      "framesLost" -> line.lost.toDouble,
      "refused"    -> line.refused,
      "alarms"     -> texts(burning.map(label)),
      "fire"       -> (if (line.isBurning) fire else ujson.Null),
      "cut"        -> cut.fold[ujson.Value](ujson.Null)(ujson.Num(_)),
      "notices"    -> texts(notices),
      "slaves"     -> ujson.Arr.from(places.map(slave)),
      "zones"      -> texts(expected.zones(master.id).map(_._1)),
      "orders"     -> ujson.Arr.from(Orders.requests(orders).map(order))
    )

    private def order(r: Request): ujson.Obj = ujson.Obj(
      "id"   -> r.id,
      "text" -> r.text,
      "state" -> (r.outcome match {
        case Some(Right(_))                                      => "done"
        case Some(Left(_))                                       => "failed"
        case None if r.isSent                                    => "sent"
        case None if Orders.current(orders).exists(_.id == r.id) => "next"
        case None                                                => "waiting"
      }),
      "asked"    -> r.tickets.head.asked.toString,
      "progress" -> text(r.progress),
      "reason"   -> text(r.outcome.flatMap(_.left.toOption))
    )

    /** Positions that burn, the first fire first. */
    private val burning: Vector[Int] = line.fires.toVector.sortBy { case (i, since) => (since, i) }.map(_._1)

    private def fire: ujson.Obj = ujson.Obj(
      "at" -> ujson.Arr.from(burning.map { i =>
        val here = slaves.lift(i)
        ujson.Obj(
          "label" -> label(i),
          "zone"  -> zone(i),
          "node"  -> here.fold[ujson.Value](ujson.Null)(_.node),
          "since" -> line.fires(i).toString,
          "smoke" -> here.exists(_.has(SlaveStatus.Alarm))
        )
      }),
      "sounding"     -> line.has(MasterStatus.Sounding),
      "acknowledged" -> time(acknowledged)
    )

    /** When somebody has acknowledged the fire that is the last one now. */
    private def acknowledged: Option[Instant] = orders
      .findLast(t => t.order == Order.Acknowledge && t.outcome.contains(Right(())))
      .filter(_.askedMs >= master.fireMs)
      .map(_.asked)

    /** Position of the first slave behind the cut: as the master says it of a ring, else of the first one
      * that is absent, if all behind it are.
      */
    private def cut: Option[Int] =
      if (line.has(MasterStatus.RingOpen)) Some(line.cut)
      else {
        val behind = slaves.reverseIterator.takeWhile(_.has(SlaveStatus.Absent)).size
        Option.when(behind > 0)(slaves.size - behind)
      }

    private def notices: Seq[String] = Seq(
      Option.when(unproven)(
        "The reports of this master are not proven: it does not take the answers of this server. Nothing " +
          "that it tells counts."
      ),
      Option.when(silent && master.life.isEmpty)("This master has never reported."),
      Option.when(silent && master.life.nonEmpty)(
        "This master does not report. What is shown is what it told last."
      ),
      Option.when(line.selfTest != SelfTest.Good)(s"Master: ${EventText.selfTest(line.selfTest)}.")
    ).flatten ++
      EventText.masterFaults.collect { case (bit, what) if line.has(bit) => what } ++ Seq(
        Option.when(losesFrames)(
          s"Frames are lost, ${LostFrames.TooMany} or more within ${LostFrames.WithinMs / 1000} s: a cable " +
            "or a plug may be bad."
        ),
        Option.when(line.isBurning && burning.isEmpty)("The master tells a fire, but no slave does."),
        Option.when(line.present > slaves.size)(
          s"${count(line.present - slaves.size.toLong, "slave")} more than this master lists. They are not " +
            "watched."
        ),
        Option.when(wanted.isEmpty && master.life.nonEmpty)(
          "There is no list of this master's slaves: a slave that is missing from the start is not noticed."
        ),
        places.map(wrong).zipWithIndex.collect {
          case (w, i) if w.nonEmpty => s"${label(i)}: ${w.mkString(", ")}"
        } match {
          case Nil   => None
          case found => Some(s"Not as it is to be: ${found.mkString("; ")}.")
        },
        Option.when(master.gaps.nonEmpty)(
          s"Events ${list(master.gaps.map { case (first, last) => range(first, last) })} of this life of " +
            "the master are not in this log, and the master has them no more."
        ),
        Option.when(missing.nonEmpty)(
          "Alarm records are missing in this log: " +
            s"${list(missing.toSeq.sorted.map { case (node, n) => s"$n of ID $node" })}."
        )
      ).flatten

    /** What is wrong with the slave at a position: it is another one than expected, or has a double. */
    private def wrong(position: Int): Seq[String] = {
      val here            = slaves.lift(position).filter(!_.has(SlaveStatus.Absent))
      def name(node: Int) = if (node == 0) "an ordinary slave" else s"ID $node"
      val place           = expected.slave(master.id, position)
      val isMember        = here.exists(h => wanted.exists(_.exists(_.node == h.node)))
      val twins           = here.toSeq.flatMap(h => line.answering(h.node)).filter(_ != position)
      val elsewhere       = place.toSeq.flatMap(p => line.answering(p.node)).filter(_ != position)
      def found           = if (elsewhere.isEmpty) "" else s", it is at ${list(elsewhere.map(label))}"
      def owner = wanted.toSeq.flatMap(w => here.map(h => w.indexWhere(_.node == h.node))).filter(_ >= 0)
      // A master that has not told its slaves yet knows of none that is missing.
      val notTold = silent && slaves.isEmpty
      Seq(
        place.filter(_ => here.isEmpty && !notTold).map(p => s"${name(p.node)} is missing$found"),
        place
          .filter(p => here.exists(_.node != p.node))
          .map { p =>
            val whose =
              if (here.get.node == 0) ""
              else if (isMember) s", which belongs to ${list(owner.map(label))}"
              else ", an unknown slave"
            s"${name(p.node)} is expected$found; here is ${name(here.get.node)}$whose"
          },
        here
          .filter(_ => wanted.nonEmpty && place.isEmpty)
          .map(h => s"no slave is expected here, but ${name(h.node)} is"),
        Option.when(twins.nonEmpty)(s"same ID as ${list(twins.map(label))}")
      ).flatten
    }

    private def slave(position: Int): ujson.Obj = {
      val here          = slaves.lift(position)
      val (state, said) = told(position)
      val node          = here.map(_.node).orElse(expected.slave(master.id, position).map(_.node)).get
      ujson.Obj(
        "label"    -> label(position),
        "zone"     -> zone(position),
        "position" -> position,
        "node"     -> node,
        "status"   -> here.fold[ujson.Value](ujson.Null)(_.status),
        "state"    -> state,
        "text"     -> said.head,
        "notes"    -> texts(said.tail ++ notes(position)),
        "since"    -> time(line.fires.get(position)),
        "wrong"    -> texts(wrong(position)),
        "sounding" -> here.exists(_.has(SlaveStatus.Sounding)),
        "burning"  -> here.exists(_.has(SlaveStatus.Alarm | SlaveStatus.Latched)),
        "twin"     -> here.exists(h => !h.has(SlaveStatus.Absent) && line.answering(h.node).size > 1)
      )
    }

    /** The state for shape and colour: alarm, fault, lost, test, off, normal or unknown; and all that is to
      * be said, the most urgent first. An alarm hides every fault.
      */
    private def told(position: Int): (String, Seq[String]) = {
      val here           = slaves.lift(position)
      val said           = here.toSeq.flatMap(s => EventText.slave(s.status))
      val known          = wrong(position) ++ said
      def has(bits: Int) = here.exists(_.has(bits))
      if (line.fires.contains(position)) {
        val fire = said.filter(_.startsWith("alarm"))
        // What it told before it was lost.
        val text = fire.headOption.getOrElse("alarm")
        ("alarm", (if (has(SlaveStatus.Absent)) s"$text, then lost" else text) +: known.diff(fire))
      } else if (has(SlaveStatus.Absent) || here.isEmpty && !(silent && slaves.isEmpty))
        ("lost", ("lost" +: known).filter(_ != "absent"))
      else if (wrong(position).exists(_.contains("expected")))
        ("fault", "wrong slave" +: known.filter(_ != "wrong slave"))
      else if (wrong(position).nonEmpty || has(SlaveStatus.Faults)) ("fault", known)
      else if (has(SlaveStatus.Disabled)) ("off", "disabled" +: known.filter(_ != "disabled"))
      else if (has(SlaveStatus.Testing | SlaveStatus.TestAlarm)) ("test", known)
      else if (here.isEmpty) ("unknown", Seq("nothing told yet"))
      else if (here.exists(_.isOrdinary)) ("unknown", Seq("no alarm slave"))
      else if (silent) ("unknown", Seq("unknown", "before: normal") ++ known)
      else ("normal", "normal" +: known)
    }

    private def notes(position: Int): Seq[String] = slaves.lift(position).toSeq.flatMap { here =>
      val detail = line.details.get(position).filter(_.node == here.node)
      Seq(
        detail.filter(_ => here.has(SlaveStatus.Unwell)).map(d => EventText.selfTest(d.selfTest)),
        detail.filter(_.dropped > 0).filter(_ => here.has(SlaveStatus.Dropped)).map { d =>
          if (d.dropped == 255) "255 or more dropped" else s"${d.dropped} dropped"
        },
        detail.filter(_.lostRecords).map(_ => "records lost while it was absent"),
        missing.get(here.node).map(n => s"${count(n.toLong, "record")} missing in the log")
      ).flatten
    }
  }

  /** An entry of the log. */
  def json(e: LogEntry, expected: Expected): ujson.Obj = ujson.Obj(
    "id"       -> e.id.toDouble,
    "received" -> e.received.toString,
    "master"   -> e.life.master,
    "ring"     -> LogEntry.isOfRing(e.event.kind),
    "label"    -> EventText.position(e.event).fold("")(expected.label(e.life.master, _)),
    "node"     -> EventText.node(e.event).fold[ujson.Value](ujson.Null)(ujson.Num(_)),
    "severity" -> EventText.severity(e.event),
    "text"     -> e.text
  )
}
