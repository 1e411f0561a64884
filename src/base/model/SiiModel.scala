package flyframe.model

import flyframe.registers.{Register, SiiRegisters}

/** The SII interface (SII-10 to SII-15, B-63 to B-66), without time: a command is done when it starts.
  *
  * @param image
  *   content of the EEPROM, bytes; None: nobody acknowledges
  * @param emulated
  *   the host answers the commands (SII-21 to SII-24)
  * @param loads
  *   called after a good reload
  */
class SiiModel(
    registers: ModelRegisters,
    image: Option[Seq[Int]],
    emulated: Boolean,
    loaded: () => Boolean,
    loads: () => Unit
) extends ModelUnit {
  import SiiModel.CommandByte
  private val content       = image.map(_.toArray)
  private var writeEnable   = false
  private var checksumError = false
  private var commandError  = false
  private var writeError    = false
  private var failed        = false             // the last load
  private var waiting       = Option.empty[Int] // command of the frame that is ending

  // Emulation: the command the host is to answer, and of a load what it has answered.
  private var served  = Option.empty[Int]
  private var area    = Vector.empty[Int]
  private var again   = false
  private var isFirst = true

  private def offered = registers.value("eeprom_offered") == 1
  private def taken   = registers.value("eeprom_taken") == 1

  /** The load after reset has found no configuration. */
  var firstFailed: Boolean = false

  if (emulated) serve(4)

  override def status(field: String): Option[Int] = {
    val set = field match {
      case "eeprom_command"           => return Some(served.getOrElse(0))
      case "eeprom_write_enable"      => Some(taken) // of ECAT: clears itself at the end of the frame
      case "eeprom_two_address_bytes" => Some(content.exists(_.length > 2048))
      case "eeprom_checksum_error"    => Some(checksumError)
      case "eeprom_not_loaded"        => Some(!loaded())
      case "eeprom_command_error"     => Some(commandError)
      case "eeprom_write_error"       => Some(writeError)
      case "eeprom_busy"              => Some(served.isDefined)
      case "eeprom_event"             => Some(served.isDefined)
      case _                          => None
    }
    set.map(if (_) 1 else 0)
  }

  override def guard(name: String): Option[Boolean] = name match {
    case "sii_ecat_may_write" => Some(!offered && !taken && served.isEmpty)
    case "sii_pdi_may_write"  => Some((offered || taken) && served.isEmpty)
    case "sii_pdi_may_answer" => Some(offered || taken || served.isDefined)
    case "sii_pdi_may_take"   => Some((offered || taken) && registers.value("eeprom_force") == 0)
    case _                    => None
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit = address match {
    case SiiRegisters.EcatAccess => if ((byte & 2) != 0) registers.set("eeprom_taken", 0)
    case SiiRegisters.Control    => if (!byHost) writeEnable = (byte & 1) == 1
    case CommandByte =>
      if (served.isEmpty) command(byte & 7, byHost)
      else if (byHost && served.contains(byte & 7)) answered((byte & 0x20) != 0)
    case _ =>
  }

  /** The last load found no configuration, for the ERR LED. */
  def loadFailed: Boolean = failed

  /** The register writes of a frame are done: its command sees them all (SII-13), and write enable was for
    * its commands only.
    */
  def frameEnds(): Unit = {
    waiting.foreach(start)
    waiting = None
    writeEnable = false
  }

  private def command(code: Int, byHost: Boolean): Unit = if (waiting.isEmpty) {
    if (Seq(0, 1, 2, 4).contains(code)) {
      commandError = false
      writeError = false
    }
    code match {
      case 0                            =>
      case 2 if !byHost && !writeEnable => writeError = true
      case 1 | 2 | 4                    => if (byHost) start(code) else waiting = Some(code)
      case _                            => commandError = true
    }
  }

  private def start(code: Int): Unit = content match {
    case _ if emulated =>
      again = false
      serve(code)
    case Some(c) => execute(code, c)
    case None =>
      commandError = true
      failed |= code == 4
  }

  private def execute(code: Int, bytes: Array[Int]): Unit = {
    val address = (2 * registers.wide("eeprom_address") % bytes.length).toInt
    def value(from: Int, count: Int): Long =
      (0 until count).map(i => bytes((address + from + i) % bytes.length).toLong << 8 * i).sum
    code match {
      case 1 =>
        registers.setWide("eeprom_data", value(0, 2))
        registers.setWide("eeprom_data_high", value(2, 6))
      case 2 =>
        val data = registers.value("eeprom_data")
        bytes(address) = data & 0xff
        bytes((address + 1) % bytes.length) = data >> 8
      case _ => if (load(bytes.toSeq, first = false)) loads()
    }
  }

  /** A command waits for the host; a load asks for words 0 to 3, then for 4 to 7. */
  private def serve(code: Int): Unit = {
    served = Some(code)
    if (code == 4) {
      area = Vector.empty
      registers.setWide("eeprom_address", 0)
    }
  }

  /** The host has carried out the command, or could not. */
  private def answered(failure: Boolean): Unit = if (!served.contains(4)) {
    commandError = failure
    served = None
  } else {
    def data(name: String, bytes: Int) =
      (0 until bytes).map(i => (registers.wide(name) >> 8 * i & 0xff).toInt)
    if (!failure) area ++= data("eeprom_data", 2) ++ data("eeprom_data_high", 6)
    if (!failure && area.size < 16) registers.setWide("eeprom_address", 4)
    else {
      served = None
      if (!failure && load(area, isFirst)) {
        isFirst = false
        loads()
      } else if (!again) {
        again = true
        checksumError = false
        serve(4)
      } else {
        firstFailed |= isFirst
        isFirst = false
        failed = true
        if (failure) commandError = true
      }
    }
  }

  /** The load after reset. */
  def loadFirst(): Boolean = {
    firstFailed = !content.exists(c => load(c.toSeq, first = true))
    !firstFailed
  }

  /** Takes the configuration area into the registers (SII-07, SII-08); false if its checksum is wrong. */
  private def load(bytes: Seq[Int], first: Boolean): Boolean = {
    def word(i: Int) = bytes(2 * i) | bytes(2 * i + 1) << 8
    checksumError =
      SiiModel.checksum(bytes.take(14)) != (word(7) & 0xff) && word(7) != SiiRegisters.ChecksumOff
    if (!checksumError) {
      registers.set("pdi_type", word(0) & 0xff)
      registers.set("pdi_configuration", word(1))
      if (registers.has("sync_pulse_length")) registers.set("sync_pulse_length", word(2))
      registers.set("extended_pdi_configuration", word(3))
      registers.set("esc_configuration_a5", word(5))
      registers.set("dl_configuration", word(5) >> 4 & 0xf)
      if (first) registers.set("rx_fifo_size", ~(word(5) >> 9) & 7) // LP-12
      registers.set("esc_configuration_a6", word(6) & 0xff)
      val a0  = word(0) >> 8
      val old = registers.value("esc_configuration") << 1
      if (first) registers.set("station_alias", word(4))
      // Of 0x0141 a reload changes bits 0, 2 and 3 only (SII-08).
      registers.set("device_emulation", a0 & 1)
      registers.set("esc_configuration", (if (first) a0 else (old & 0xf2) | (a0 & 0x0c)) >> 1)
    }
    failed = checksumError
    !checksumError
  }
}

object SiiModel {

  /** The byte with the command. */
  private val CommandByte = SiiRegisters.Control + 1

  /** CRC-8 of the configuration area (SII-01). */
  def checksum(bytes: Seq[Int]): Int = bytes.foldLeft(0xff) { (start, byte) =>
    (0 until 8).foldLeft(start ^ byte)((crc, _) =>
      if ((crc & 0x80) != 0) (crc << 1 ^ 0x07) & 0xff else crc << 1
    )
  }
}
