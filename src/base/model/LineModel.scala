package flyframe.model

/** A line of controllers: port 1 of each is wired to port 0 of the next, the master to port 0 of the first.
  *
  * @param slaves
  *   first one next to the master
  */
class LineModel(val slaves: Seq[EscModel]) {
  require(slaves.nonEmpty, "A line has 0 slaves but must have 1 or more.")
  for (s <- slaves)
    require(s.p.ports >= 2, s"ports is ${s.p.ports} but must be 2 to 4 for a slave of a line.")
  slaves.foreach(s => (2 until s.p.ports).foreach(s.setLink(_, up = false)))
  slaves.last.setLink(1, up = false)
  private var cut = Set.empty[Int]

  /** Cuts the cable before slave `index`, counted from 0, or mends it. */
  def setCable(index: Int, intact: Boolean): Unit = {
    cut = if (intact) cut - index else cut + index
    slaves(index).setLink(0, intact)
    if (index > 0) slaves(index - 1).setLink(1, intact)
  }

  /** What the master gets back for `frame`; None if it was lost. */
  def send(frame: WireFrame): Option[SentFrame] = if (cut(0)) None else arrive(0, 0, frame)

  @annotation.tailrec
  private def arrive(slave: Int, port: Int, frame: WireFrame): Option[SentFrame] =
    slaves(slave).receive(port, frame) match {
      case Some((0, sent)) if slave == 0                                 => Some(sent)
      case Some((0, sent)) if !cut(slave)                                => arrive(slave - 1, 1, sent.onWire)
      case Some((1, sent)) if slave + 1 < slaves.size && !cut(slave + 1) => arrive(slave + 1, 0, sent.onWire)
      case _                                                             => None
    }
}
