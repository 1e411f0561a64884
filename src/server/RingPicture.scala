package flyframe.server

/** A ring, as the page shows it (GW-07).
  *
  * @param silent
  *   its gateway has not reported for too long
  * @param unproven
  *   its reports come, but do not count
  * @param orders
  *   the last messages to it
  */
final case class RingPicture(ring: Ring, silent: Boolean, unproven: Boolean, orders: Seq[RingOrder]) {
  private def texts(t: Iterable[String]): ujson.Value = ujson.Arr.from(t.map(ujson.Str(_)))
  private def text(t: Option[String]): ujson.Value    = t.fold[ujson.Value](ujson.Null)(ujson.Str(_))

  def json: ujson.Obj = ujson.Obj(
    "id"       -> ring.id,
    "life"     -> text(ring.life.map(_.hex)),
    "silent"   -> silent,
    "unproven" -> unproven,
    "heard"    -> text(ring.heard.map(_.toString)),
    "present"  -> ring.nodes.values.count(n => n.present && !n.isOld),
    "text"     -> (if (ring.isTold) RingText.ends(ring.ends) else "not known yet whether the ring is whole"),
    "whole"    -> (ring.isTold && ring.ends.isEmpty),
    "broken"   -> (ring.isTold && ring.ends.nonEmpty),
    "ends" -> ring.ends.filter(_ => ring.isTold).fold[ujson.Value](ujson.Null) { case (a, b) =>
      ujson.Arr(ujson.Num(a), ujson.Num(b))
    },
    "notices" -> texts(notices),
    "urgent"  -> ujson.Arr.from(ring.urgent.map(message)),
    "nodes"   -> ujson.Arr.from(ring.order.map(a => node(a, ring.nodes(a)))),
    "orders"  -> ujson.Arr.from(orders.map(order))
  )

  private def notices: Seq[String] = Seq(
    Option.when(unproven)(
      "Reports of this gateway come, but none of them counts: it does not take our answers."
    ),
    Option.when(silent)("The gateway is silent: what is shown was told before."),
    Option.when(ring.gaps.nonEmpty)(
      "Parts of this life of the gateway are not in this log, and the gateway has them no more: " +
        ring.gaps.map { case (first, last) => s"$first to $last" }.mkString(", ") + "."
    )
  ).flatten ++ RingText.notices(ring.status)

  private def node(address: Int, n: RingNode): ujson.Obj = {
    val words = if (n.isOld) Seq("not heard yet") else RingText.node(n)
    val state =
      if (!n.present) "lost"
      else if (silent || n.isOld) "unknown"
      else if (words.forall(_ == "guard")) "normal"
      else "fault"
    ujson.Obj(
      "address" -> address,
      "gateway" -> (address == Ring.Gateway),
      "state"   -> state,
      "text"    -> ujson.Str(words.headOption.getOrElse("normal")),
      "notes"   -> texts(words.drop(1)),
      "up"      -> ujson.Arr(ujson.Bool(n.present && n.isUp(1)), ujson.Bool(n.present && n.isUp(2))),
      "life"    -> n.life,
      "type"    -> n.deviceType,
      "version" -> n.version
    )
  }

  private def message(e: LogEntry): ujson.Obj =
    ujson.Obj("id" -> e.id.toDouble, "received" -> e.received.toString, "text" -> e.text)

  private def order(o: RingOrder): ujson.Obj = ujson.Obj(
    "id"   -> o.id,
    "to"   -> o.destination,
    "text" -> o.text,
    "state" -> (o.outcome match {
      case Some(Right(()))            => "delivered"
      case Some(Left(why))            => why
      case None if o.taken            => "on its way"
      case None if o.counter.nonEmpty => "sent, waiting for the gateway"
      case None                       => "waits for the one before"
    }),
    "done" -> o.outcome.exists(_.isRight)
  )
}
