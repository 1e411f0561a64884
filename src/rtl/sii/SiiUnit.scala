package flyframe.sii

import chisel3._
import chisel3.util._
import flyframe.clocks.LevelCrossing
import flyframe.memory.{RegisterBus, RegisterUnit}
import flyframe.params.EscParams
import flyframe.registers.SiiRegisters

/** [[SiiController]] behind its registers.
  *
  * @param pins
  *   of the I2C EEPROM, if it is not emulated
  */
class SiiUnit(p: EscParams, pins: Option[SiiPins]) extends RegisterUnit(SiiRegisters(p)) {
  private val unit = Module(new SiiController(p)).suggestName("sii")

  /** The configuration is loaded. */
  val loaded: Bool = !unit.notLoaded

  /** The last load found no configuration; the first one is under way. */
  val loadFailed: Bool = unit.loadFailed
  val loading: Bool    = unit.loading

  def connect(bus: RegisterBus): Unit = {
    for (eeprom <- pins; lines <- unit.lines) {
      lines.sda                              := LevelCrossing(eeprom.sda)
      lines.twoByte                          := LevelCrossing(eeprom.two_byte)
      eeprom.scl_low                         := lines.sclLow
      eeprom.sda_low                         := lines.sdaLow
      bus.status("eeprom_two_address_bytes") := lines.twoByte
    }

    unit.writeLow  := bus.written("eeprom_write_enable")
    unit.writeHigh := bus.written("eeprom_command")
    unit.failure.foreach(_ := bus.written("eeprom_command_error").bits)
    unit.byHost        := bus.writtenByHost
    unit.frameStart    := bus.frame.begins
    unit.registersBusy := bus.writesPending
    unit.offered       := bus.bool("eeprom_offered")
    unit.forced        := bus.bool("eeprom_force")
    unit.taken         := bus.bool("eeprom_taken")
    val a0 = bus.value("esc_configuration") // bits 7:1
    unit.enhancedLinkDetection := Cat(a0(6, 3), a0(0))
    unit.fifoSize              := bus.value("rx_fifo_size")
    bus.ramWrite <> unit.write
    bus.ramRead <> unit.read
    unit.data := bus.ramData

    bus.guard("sii_ecat_may_write") := unit.ecatMayWrite
    bus.guard("sii_pdi_may_write")  := unit.pdiMayWrite
    bus.guard("sii_pdi_may_answer") := unit.pdiMayWrite || unit.waits
    bus.guard("sii_pdi_may_take")   := (unit.offered || unit.taken) && !unit.forced
    bus.set("eeprom_taken", unit.forced, 0.U)
    bus.status("eeprom_write_enable")                                       := unit.writeEnable
    bus.status("eeprom_command")                                            := unit.command
    bus.status("eeprom_checksum_error")                                     := unit.checksumError
    bus.status("eeprom_not_loaded")                                         := unit.notLoaded
    bus.status("eeprom_command_error")                                      := unit.commandError
    bus.status("eeprom_write_error")                                        := unit.writeError
    bus.status("eeprom_busy")                                               := unit.busy
    if (p.hasEmulation && p.hasApplicationLayer) bus.status("eeprom_event") := unit.waits
  }
}
