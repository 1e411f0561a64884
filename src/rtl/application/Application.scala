package flyframe.application

import chisel3._
import chisel3.util._
import flyframe.params.EscParams

/** AL control and status ([[flyframe.registers.ApplicationRegisters]]), and the event requests towards master
  * and host ([[flyframe.registers.EventRegisters]]; AL-01 to AL-06, IRQ-01 to IRQ-08).
  */
class Application(p: EscParams) extends Module {

  /** AL control, AL status as stored; emulation: AL status follows AL control (AL-05). */
  val alControl = IO(Input(UInt(7.W)))
  val alStatus  = IO(Input(UInt(7.W)))
  val emulation = IO(Input(Bool()))

  /** AL control was written by ECAT, read by the PDI. */
  val alControlWritten = IO(Input(Bool()))
  val alControlRead    = IO(Input(Bool()))

  /** AL status is to be loaded with AL control. */
  val copyControl = IO(Output(Bool()))

  /** ECAT may write AL control (AL-04). */
  val alControlFree = IO(Output(Bool()))

  val dlStatus = IO(Input(UInt(16.W)))

  /** ECAT read DL status, AL status; the frame ends well, badly. */
  val readDlStatus = IO(Input(Bool()))
  val readAlStatus = IO(Input(Bool()))
  val good         = IO(Input(Bool()))
  val bad          = IO(Input(Bool()))

  /** Of each SyncManager: its events, and whether 0x0806 changed since the PDI read it. */
  val smEcatEvents = IO(Input(UInt(p.syncManagers.W)))
  val smAlEvents   = IO(Input(UInt(p.syncManagers.W)))
  val smChanged    = IO(Input(UInt(p.syncManagers.W)))
  val watchdog     = IO(Input(Bool()))

  /** An EEPROM command waits for the host (SII-21). */
  val eeprom = IO(Input(Bool()))

  val ecatMask = IO(Input(UInt(16.W)))

  /** 0x0204 in the layout of 0x0220, as far as there are events. */
  val alMask = IO(Input(UInt((8 + p.syncManagers).W)))

  /** 0x0210 and 0x0220. */
  val ecatEvents = IO(Output(UInt(16.W)))
  val alEvents   = IO(Output(UInt(32.W)))

  /** For the IRQ field of datagrams, and the interrupt to the host. */
  val irqField = IO(Output(UInt(16.W)))
  val irq      = IO(Output(Bool()))

  // Reset of all: no event, AL control open.
  private val controlEvent = RegInit(false.B)
  // A read is acknowledged a cycle late: what was written in between it has not seen.
  when(alControlRead && !RegNext(alControlWritten, false.B)) { controlEvent := false.B }
  when(alControlWritten && !emulation) { controlEvent := true.B }
  alControlFree := emulation || !controlEvent
  copyControl   := RegNext(alControlWritten, false.B) && emulation

  /** Set by a change of `value`, cleared at the good end of a frame that read it and saw the last change. */
  private def changeEvent(value: UInt, reset: Int, read: Bool): Bool = {
    val before  = RegNext(value, reset.U)
    val pending = RegInit(false.B) // read in this frame
    val event   = RegInit(false.B)
    when(read) { pending := true.B }
    when(good || bad) { pending := false.B }
    when(good && pending) { event := false.B }
    when(value =/= before) {
      event   := true.B
      pending := false.B
    }
    event
  }
  private val dlEvent = changeEvent(dlStatus, 0, readDlStatus)
  private val alEvent = changeEvent(alStatus, 1, readAlStatus)

  private val forMaster = smEcatEvents.pad(8)(7, 0)
  ecatEvents := Cat(0.U(4.W), forMaster, alEvent, dlEvent, 0.U(2.W))
  alEvents := Cat(
    0.U(8.W),
    smAlEvents.pad(16),
    0.U(1.W),
    watchdog,
    eeprom,
    smChanged.orR,
    0.U(3.W),
    controlEvent
  )
  irqField := ecatEvents & ecatMask
  irq      := (alEvents & alMask).orR
}
