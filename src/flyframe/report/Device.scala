package flyframe.report

/** A Cyclone IV E that boards have, all of them in package E144, from the maker's data sheet.
  *
  * @param logicElements
  *   it has
  * @param m9k
  *   memory blocks of 9 Kbit
  */
final case class Device(name: String, logicElements: Int, m9k: Int) {

  /** Whether something of this size has a place in it. */
  def fits(area: Area): Boolean = area.logicElements <= logicElements && area.m9k <= m9k
}

object Device {

  /** From the smallest to the largest. */
  val all: Seq[Device] =
    Seq(Device("EP4CE6", 6272, 30), Device("EP4CE10", 10320, 46), Device("EP4CE15", 15408, 56))

  /** That of an ordering code, such as EP4CE6E22C8. */
  def named(code: String): Device = all
    .find(d => code.startsWith(s"${d.name}E"))
    .getOrElse(throw new NoSuchElementException(s"$code is no device that is known here."))
}
