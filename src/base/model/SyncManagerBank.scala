package flyframe.model

import flyframe.registers.Register

/** All SyncManagers with their registers.
  *
  * @param exists
  *   there is memory at a local address
  */
class SyncManagerBank(count: Int, registers: ModelRegisters, exists: Int => Boolean, trigger: () => Unit)
    extends ModelUnit {
  val managers: IndexedSeq[SyncManagerModel] = Vector.fill(count)(new SyncManagerModel(exists, trigger))
  private val deactivated                    = Array.fill(count)(false)
  private val activation                     = Array.fill(count)(0)     // +6 as it was last
  private val changed                        = Array.fill(count)(false) // B-60

  /** The one an address belongs to (B-51). */
  def owner(address: Int): Option[SyncManagerModel] = managers.find(_.settings.covers(address))

  def frameStarts(): Unit            = managers.foreach(_.frameStarts())
  def frameEnds(good: Boolean): Unit = managers.foreach(_.frameEnds(good))
  def activationEvent: Boolean       = changed.contains(true)

  /** A written buffer is news for the side that reads, a read one for the side that writes (0x0805[1:0]). */
  private def eventsFor(side: Side, enabled: SyncManagerSettings => Boolean): Int =
    managers.zipWithIndex.collect {
      case (m, n) if enabled(m.settings) && (if (m.settings.writer == side) m.readEvent else m.writeEvent) =>
        1 << n
    }.sum
  def alEvents: Int   = eventsFor(Side.Pdi, _.alEvent)
  def ecatEvents: Int = eventsFor(Side.Ecat, _.ecatEvent) & 0xff

  private val Name = "sm(\\d+)_(.*)".r

  private def bit(value: Boolean): Int = if (value) 1 else 0

  override def status(field: String): Option[Int] = field match {
    case "sm_activation_event" => Some(bit(activationEvent))
    case "sm_al_event"         => Some(alEvents)
    case "sm_ecat_event"       => Some(ecatEvents)
    case Name(n, part) =>
      val m = managers(n.toInt)
      part match {
        case "write_event"  => Some(bit(m.writeEvent))
        case "read_event"   => Some(bit(m.readEvent))
        case "mailbox_full" => Some(bit(m.mailboxFull))
        case "last_buffer"  => Some(m.lastBuffer)
        case "deactivated"  => Some(bit(deactivated(n.toInt)))
        case _              => None
      }
    case _ => None
  }

  override def guard(name: String): Option[Boolean] = name match {
    case Name(n, "disabled") => Some(registers.value(s"sm${n}_enable") == 0)
    case _                   => None
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit =
    register.name match {
      case Name(number, part) =>
        val n = number.toInt
        if (part == "pdi_control") deactivated(n) = (byte & 1) == 1
        if (part == "activate") {
          changed(n) |= activation(n) != (byte & 3)
          activation(n) = byte & 3
        }
        configure(n)
      case _ =>
    }

  private def configure(n: Int): Unit = {
    def value(name: String) = registers.value(s"sm${n}_$name")
    managers(n).configure(
      SyncManagerSettings(
        value("start"),
        value("length"),
        value("control"),
        value("enable") == 1,
        deactivated(n)
      )
    )
  }

  override def readByHost(register: Register): Unit = register.name match {
    case Name(n, "activate") => changed(n.toInt) = false
    case _                   =>
  }
}
