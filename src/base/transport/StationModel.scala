package flyframe.transport

import scala.collection.mutable

/** What a node sends without an answer: HELLO (TP-31) and process data (TP-50). */
private[transport] class StationModel(p: TransportParams, slots: SlotsModel, start: Long) {
  private class Own(var data: Seq[Int]) {
    var due   = start
    var isDue = true
  }
  private class Followed {
    var data    = Seq.empty[Int]
    var heardAt = Option.empty[Long]
  }
  private val own      = mutable.LinkedHashMap.empty[(Int, Int), Own]
  private val followed = mutable.Map.empty[(Int, Int), Followed]
  private val heard    = mutable.Map.empty[Int, Long]
  private var bytes    = p.hello
  private var helloAt  = start // the last one was due
  private var isDue    = true
  private var isNews   = false // a port has come up or gone down
  private var newsFrom = start // when that may be told early
  private var turn     = 0     // the place of the value that goes next, if it is due

  def hello(source: Int, now: Long): Unit = heard(source) = now
  def members(now: Long): Set[Int]        = heard.collect { case (s, at) if now < at + p.memberUs => s }.toSet

  /** All of whom a HELLO has ever come. */
  def known: Set[Int] = heard.keySet.toSet

  /** HELLO was taken back. */
  def helloAgain(): Unit = isDue = true

  def setHello(next: Seq[Int]): Unit = {
    if (((next(1) ^ bytes(1)) & StationModel.PortsUp) != 0) isNews = true
    bytes = next
  }

  def set(destination: Int, number: Int, data: Seq[Int]): Boolean = {
    val known    = own.get(destination -> number)
    val hasPlace = data.size <= Sizes.Frame && (known.nonEmpty || own.size < Sizes.Objects)
    if (hasPlace) known match {
      case Some(o) =>
        if (o.data != data) o.isDue = true
        o.data = data
      case None => own(destination -> number) = new Own(data)
    }
    hasPlace
  }

  def watch(source: Int, number: Int): Boolean =
    followed.contains(source -> number) || {
      val hasPlace = followed.size < Sizes.Watched
      if (hasPlace) followed(source -> number) = new Followed
      hasPlace
    }

  def forgetValues(): Unit = {
    own.clear()
    followed.clear()
    turn = 0
  }

  /** A value has come. False: nobody follows it. */
  def arrives(source: Int, number: Int, data: Seq[Int], now: Long): Boolean =
    followed
      .get(source -> number)
      .map { f =>
        f.data = data
        f.heardAt = Some(now)
      }
      .nonEmpty

  def value(source: Int, number: Int, now: Long): (Seq[Int], Boolean) =
    followed.get(source -> number).fold((Seq.empty[Int], true)) { f =>
      (f.data, f.heardAt.forall(at => now >= at + 3000L * p.pdMs))
    }

  def poll(now: Long): Long = {
    def next = helloAt + p.helloUs(1 + heard.size)
    if (now >= next) {
      isDue = true
      isNews = false
      helloAt = now
    }
    if (isNews && now >= newsFrom) {
      isDue = true
      isNews = false
      newsFrom = now + p.newsUs(1 + heard.size)
    }
    val news = Option.when(isNews)(newsFrom)
    for (o <- own.values) {
      if (o.isDue || now >= o.due) {
        o.isDue = true
        o.due = now + 1000L * p.pdMs
      }
    }
    (next +: (own.values.map(_.due) ++ news).toSeq).min
  }

  private def frames: Iterator[(BusFrame, () => Unit)] = {
    val id     = FrameId(urgent = false, 0, isData = false, p.address, Code.Hello, 0, end = true)
    val hello  = Option.when(isDue)((BusFrame(id, p.life +: bytes), () => isDue = false))
    val places = own.iterator.zipWithIndex.toSeq
    val inTurn = places.drop(turn) ++ places.take(turn)
    val values = inTurn.iterator.filter(_._1._2.isDue).map { case (((to, number), o), place) =>
      val id = FrameId(urgent = false, to, isData = true, p.address, number, Sizes.ProcessData, end = true)
      val sent = () => {
        o.isDue = false
        turn = (place + 1) % Sizes.Objects
      }
      (BusFrame(id, o.data), sent)
    }
    hello.iterator ++ values
  }

  /** A value that still waits for the wire is followed by the newest one when it has left. */
  def queueOne(): Boolean =
    frames.find { case (f, _) => !slots.waits(f.id) && slots.hasRoom(FrameId.of(f.id)) } match {
      case Some((frame, sent)) =>
        slots.put(frame)
        sent()
        true
      case None => false
    }
}

private object StationModel {

  /** The bits of the ports' byte of which a change is told early. */
  val PortsUp = 0x44
}
