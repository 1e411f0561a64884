package flyframe.model

import flyframe.params.EscParams
import flyframe.registers.Register

/** All SyncManagers with their registers.
  *
  * @param exists
  *   there is memory at a local address
  * @param happens
  *   see [[SyncManagerModel]]
  */
class SyncManagerBank(
    p: EscParams,
    registers: ModelRegisters,
    exists: Int => Boolean,
    trigger: () => Unit,
    happens: BufferEvent => Unit
) extends ModelUnit {
  private def count = p.syncManagers
  val managers: IndexedSeq[SyncManagerModel] =
    Vector.tabulate(count)(n =>
      new SyncManagerModel(exists, trigger, e => if (latches(n, e)) happens(e), p.acknowledgesByWrite)
    )

  /** 0x0806[7:6] of SyncManager `n`: times of this kind are kept (DC-42). */
  private def latches(n: Int, event: BufferEvent): Boolean =
    p.hasEventTimes &&
      registers.value(s"sm${n}_latch_${if (event == BufferEvent.EcatChange) "ecat" else "pdi"}") == 1
  private val deactivated = Array.fill(count)(false)
  private val lingering   = Array.fill(count)(false)
  private val activation  = Array.fill(count)(0)     // +6 as it was last
  private val changed     = Array.fill(count)(false) // B-60

  /** The one an address belongs to (B-51). */
  def owner(side: Side, write: Boolean, address: Int): Option[SyncManagerModel] =
    managers.find(_.settings.covers(side, write, address))

  /** Something was read of the one that owns `address`: that may end its delay (SM-31). */
  def settle(): Unit = for (n <- managers.indices if lingering(n) && !managers(n).hasData) {
    lingering(n) = false
    configure(n)
  }

  /** Registers are read by this side. */
  var reader: Side = Side.Ecat

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
  def ecatEvents: Int = eventsFor(Side.Ecat, s => s.ecatEvent && !s.lingering) & 0xff

  private val Name = "sm(\\d+)_(.*)".r

  private def bit(value: Boolean): Int = if (value) 1 else 0

  override def status(field: String): Option[Int] = field match {
    case "sm_activation_event" => Some(bit(activationEvent))
    case "sm_al_event"         => Some(alEvents)
    case "sm_ecat_event"       => Some(ecatEvents)
    case Name(n, part) =>
      val m = managers(n.toInt)
      // What is switched off for ECAT looks so (SM-30).
      val hidden = m.settings.lingering && reader == Side.Ecat && !m.settings.sequential
      part match {
        case "write_event"      => Some(bit(m.writeEvent && !hidden))
        case "read_event"       => Some(bit(m.readEvent && !hidden))
        case "sequential_error" => Some(bit(m.sequentialError && !hidden))
        case "mailbox_full"     => Some(bit(m.mailboxFull && !hidden))
        case "write_open"       => Some(bit(m.writeOpen && !hidden))
        case "read_open"        => Some(bit(m.readOpen && !hidden))
        case "last_buffer"      => Some(if (hidden && !m.settings.mailbox) 3 else m.lastBuffer)
        case "deactivated"      => Some(bit(deactivated(n.toInt)))
        case "delay_active"     => Some(bit(lingering(n.toInt)))
        case _                  => None
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
        if (part == "pdi_control") {
          deactivated(n) = (byte & 1) == 1
          if (deactivated(n) || !delayed(n)) lingering(n) = false
        }
        if (Seq("start", "length", "control").contains(part)) lingering(n) = false // B-102
        if (part == "activate") {
          val (was, is) = ((activation(n) & 1) == 1, (byte & 1) == 1)
          if (is && lingering(n)) { // begins anew
            lingering(n) = false
            managers(n).configure(managers(n).settings.copy(enabled = false, lingering = false))
          }
          if (was && !is) lingering(n) = delayed(n) && managers(n).hasData
          changed(n) |= activation(n) != (byte & 3)
          activation(n) = byte & 3
        }
        configure(n)
      case _ =>
    }

  private def delayed(n: Int) = p.hasDeactivationDelay && registers.value(s"sm${n}_deactivation_delay") == 1

  private def configure(n: Int): Unit = {
    def value(name: String) = registers.value(s"sm${n}_$name")
    managers(n).configure(
      SyncManagerSettings(
        value("start"),
        value("length"),
        value("control"),
        value("enable") == 1,
        deactivated(n),
        lingering(n),
        p.hasSequentialMode
      )
    )
  }

  override def acknowledged(register: Register, address: Int): Unit = register.name match {
    case Name("0", "activate") if p.acknowledgesByWrite => changed.indices.foreach(changed(_) = false)
    case Name(n, "activate") if !p.acknowledgesByWrite  => changed(n.toInt) = false
    case _                                              =>
  }
}
