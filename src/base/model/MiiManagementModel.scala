package flyframe.model

import flyframe.params.EscParams
import flyframe.registers.{MiRegisters, Register}

/** MII management (MI-02 to MI-09, B-90 to B-92). A command takes all the time that it may.
  *
  * @param phys
  *   gives what the management bus leads to
  */
class MiiManagementModel(p: EscParams, registers: ModelRegisters, phys: () => PhyBus) extends ModelUnit {
  import MiiManagementModel._
  private var writeEnable  = false
  private var readError    = false
  private var commandError = false
  private var taken        = false
  private var force        = false
  private var data         = 0
  private var waiting      = Option.empty[Int] // command of the frame that is ending
  private var running      = Option.empty[Int]
  private var left         = 0L                // ns until that is done
  private var ofFrame      = (true, true)      // the interface was free for ECAT, and no command ran

  private def translationOff = registers.value("mi_translation_off") == 1
  private def phy            = registers.value("mi_phy_address")

  /** MI-08, MI-09, OP-21. */
  private def address: Int =
    if (translationOff) phy
    else if (phy < 4) p.phyAddress(phy)
    else (phy + p.phyAddress(0)) % 32

  override def status(field: String): Option[Int] = {
    val set = field match {
      case "mi_port_address"  => return Some(p.phyAddress(if (translationOff) phy % 4 else 0))
      case "mi_command"       => return Some(running.getOrElse(0))
      case "mi_data"          => return Some(data)
      case "mi_write_enable"  => taken // of ECAT: clears itself at the end of the frame
      case "mi_read_error"    => readError
      case "mi_command_error" => commandError
      case "mi_busy"          => running.isDefined
      case "mi_taken"         => taken
      case "mi_force"         => force
      case _                  => return None
    }
    Some(if (set) 1 else 0)
  }

  override def guard(name: String): Option[Boolean] = name match {
    case "mi_ecat_may_write"                       => Some(ofFrame == ((true, true)))
    case "mi_ecat_may_claim" | "mi_ecat_may_clear" => Some(ofFrame._1)
    case "mi_pdi_may_write"                        => Some(taken && running.isEmpty)
    case "mi_pdi_may_clear"                        => Some(taken)
    case "mi_pdi_may_take" => Some(!force && (taken || registers.value("mi_exclusive") == 0))
    case _                 => None
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit = address match {
    case MiRegisters.Control     => if (!byHost) writeEnable = (byte & 1) == 1
    case MiRegisters.CommandByte => command(byte & 7, byHost)
    case MiRegisters.Data        => data = data & 0xff00 | byte
    case High                    => data = data & 0x00ff | byte << 8
    case MiRegisters.PdiAccess =>
      if (byHost) taken = (byte & 1) == 1 else force = (byte & 2) != 0
      if (force) taken = false
    case _ =>
  }

  private def command(code: Int, byHost: Boolean): Unit = if (waiting.isEmpty && running.isEmpty) {
    readError = false
    commandError = code match {
      case 0 | 1 => false
      case 2     => !byHost && !writeEnable
      case _     => true
    }
    if (code != 0 && !commandError) if (byHost) start(code) else waiting = Some(code)
  }

  /** A frame begins: what it may write holds to its end (B-92). */
  def frameStarts(): Unit = ofFrame = (!taken, running.isEmpty)

  /** The register writes of a frame are done: its command sees them all, and write enable was for it only. */
  def frameEnds(): Unit = {
    waiting.foreach(start)
    waiting = None
    writeEnable = false
  }

  private def start(code: Int): Unit = {
    running = Some(code)
    left = CommandNs
  }

  /** Time passes, in ns. */
  def advance(ns: Long): Unit = for (code <- running) {
    left -= ns
    if (left <= 0) {
      running = None
      access(code)
    }
  }

  private def access(code: Int): Unit = {
    val register = registers.value("mi_register_address")
    if (code == 2) phys().write(address, register, data)
    else {
      val answer = phys().read(address, register)
      readError = answer.isEmpty
      data = answer.getOrElse(0xffff) // of a line with a pull-up
    }
  }
}

object MiiManagementModel {
  private val High      = MiRegisters.Data + 1
  private val CommandNs = 50000L // B-90
}
