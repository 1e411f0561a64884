package flyframe.application

import chisel3._
import chisel3.util._
import flyframe.alarm.{AlarmPins, AlarmUnit, DatagramAppender}
import flyframe.clocks.LevelCrossing
import flyframe.frame.FrameProcessor
import flyframe.host.HostSequencer
import flyframe.lanes.Lanes
import flyframe.memory.{EscMemory, HostPort}
import flyframe.params.EscParams
import flyframe.protocol.{AlState, ConfirmLayout, Layout, LedCode, RecordAckLayout}
import flyframe.registers.{
  AlarmRegisters,
  ApplicationRegisters,
  LedRegisters,
  Register,
  SiiRegisters,
  SyncManagerRegisters,
  WatchdogRegisters
}
import flyframe.sii.{SiiController, SiiPins}
import flyframe.syncmanager.SyncManagers

/** Builds what does not lie on the wire path, as far as the parameters ask for it, and connects it with
  * memory and frame processor: host port, SyncManagers, SII EEPROM, application layer, watchdogs, LEDs.
  *
  * A part of [[flyframe.SlaveController]] in a file of its own, not a module.
  *
  * @param added
  *   registers beside those of the units
  */
class LocalSide(p: EscParams, memory: EscMemory, processor: FrameProcessor, added: Seq[Register] = Nil) {
  private val written = memory.registerWrite

  /** The byte at `address`, one of a register, is written now by a side that may; it takes effect behind this
    * cycle.
    */
  def writes(address: Int): Valid[UInt] = written.bits.byteAt(written.valid, address)

  /** The host reads the byte at `address`, one of a register. Acknowledged a cycle late: what changes in the
    * cycle before it has not seen.
    */
  def hostReads(address: Int): Bool = memory.host.ack && !memory.host.write && hostAddresses(address)
  private def hostAddresses(address: Int): Bool =
    memory.host.addr(15, log2Ceil(p.lanes)) === (address / p.lanes).U && memory.host.be(address % p.lanes)

  private def status(name: String): UInt = memory.status.uint(name)

  processor.registerWrite.foreach(_ := written)
  memory.unitWrite.valid := false.B
  memory.unitWrite.bits  := DontCare
  memory.unitRead.valid  := false.B
  memory.unitRead.bits   := 0.U

  private val syncManagers = Option.when(p.syncManagers > 0)(Module(new SyncManagers(p)))

  /** Connects the host port. */
  def host(port: HostPort): Unit = syncManagers match {
    case None => memory.host <> port
    case Some(sms) =>
      val sequencer = Module(new HostSequencer(p, added)).suggestName("hostSequencer")
      sequencer.host <> port
      memory.host <> sequencer.memory
      sequencer.areas <> sms.pdi
      processor.areas.get <> sms.ecat
      sms.write                    := written
      sms.ramOpen                  := memory.ramOpen
      sms.good                     := processor.frameGood
      sms.bad                      := processor.frameBad
      processor.buffersSettled.get := sms.settled
      sms.quiet := sequencer.quiet && !processor.busy && !ShiftRegister(processor.busy, 8, false.B, true.B)
      for (n <- 0 until p.syncManagers) {
        sms.enable(n)                         := memory.value.bool(s"sm${n}_enable")
        memory.guard.uint(s"sm${n}_disabled") := !memory.value.bool(s"sm${n}_enable")
        status(s"sm${n}_write_event")         := sms.writeEvent(n)
        status(s"sm${n}_read_event")          := sms.readEvent(n)
        status(s"sm${n}_mailbox_full")        := sms.full(n)
        status(s"sm${n}_last_buffer")         := sms.lastBuffer(n)
        status(s"sm${n}_deactivated")         := sms.deactivated(n)
      }
  }

  /** Connects the EEPROM; the result: configuration is loaded. */
  def sii(pins: Option[SiiPins]): Bool = {
    val unit = Module(new SiiController(p)).suggestName("sii")
    def level(in: Bool) = {
      val crossing = Module(new LevelCrossing)
      crossing.in := in
      crossing.out
    }
    for (eeprom <- pins; lines <- unit.lines) {
      lines.sda                          := level(eeprom.sda)
      lines.twoByte                      := level(eeprom.two_byte)
      eeprom.scl_low                     := lines.sclLow
      eeprom.sda_low                     := lines.sdaLow
      status("eeprom_two_address_bytes") := lines.twoByte
    }

    val (low, high) = (writes(SiiRegisters.Control), writes(SiiRegisters.Control + 1))
    unit.writeLow.valid  := low.valid
    unit.writeLow.bits   := low.bits(0)
    unit.writeHigh.valid := high.valid
    unit.writeHigh.bits  := high.bits(2, 0)
    unit.failure.foreach(_ := high.bits(5))
    unit.byHost        := memory.registerWriteByHost
    unit.frameStart    := processor.memory.frameStart
    unit.registersBusy := memory.registersBusy
    unit.offered       := memory.value.bool("eeprom_offered")
    unit.forced        := memory.value.bool("eeprom_force")
    unit.taken         := memory.value.bool("eeprom_taken")
    val a0 = memory.value.uint("esc_configuration") // bits 7:1
    unit.enhancedLinkDetection := Cat(a0(6, 3), a0(0))
    unit.fifoSize              := memory.value.uint("rx_fifo_size")
    memory.unitWrite <> unit.write
    memory.unitRead <> unit.read
    unit.data := memory.unitData

    memory.guard.uint("sii_ecat_may_write")                             := unit.ecatMayWrite
    memory.guard.uint("sii_pdi_may_write")                              := unit.pdiMayWrite
    memory.guard.uint("sii_pdi_may_answer")                             := unit.pdiMayWrite || unit.waits
    if (p.hasEmulation && p.hasApplicationLayer) status("eeprom_event") := unit.waits
    siiWaits                                                            := unit.waits
    memory.guard.uint("sii_pdi_may_take") := (unit.offered || unit.taken) && !unit.forced
    memory.set.load("eeprom_taken").valid := unit.forced
    memory.set.load("eeprom_taken").bits  := 0.U
    status("eeprom_write_enable")         := unit.writeEnable
    status("eeprom_command")              := unit.command
    status("eeprom_checksum_error")       := unit.checksumError
    status("eeprom_not_loaded")           := unit.notLoaded
    status("eeprom_command_error")        := unit.commandError
    status("eeprom_write_error")          := unit.writeError
    status("eeprom_busy")                 := unit.busy
    siiError                              := unit.loadFailed
    siiLoading                            := unit.loading
    !unit.notLoaded
  }
  private val siiError   = WireDefault(false.B)
  private val siiLoading = WireDefault(false.B)
  private val siiWaits   = WireDefault(false.B)

  // Set by `application`, used by `leds`.
  private val alChanged          = WireDefault(false.B)
  private val emulation          = if (p.hasSii) memory.value.bool("device_emulation") else false.B
  private val watchdogExpired    = WireDefault(false.B)
  private val pdiWatchdogExpired = WireDefault(false.B)

  /** The process data watchdog has not expired. */
  val processDataRuns: Bool = WireDefault(true.B)

  /** Connects application layer and watchdogs; the result: events for the IRQ field of datagrams and the
    * host.
    */
  def application(dlStatus: UInt): LocalSide.Events =
    if (!p.hasApplicationLayer) LocalSide.Events(0.U(16.W), false.B)
    else {
      val unit      = Module(new Application(p)).suggestName("application")
      val alControl = Seq(ApplicationRegisters.Control, ApplicationRegisters.Control + 1)
      unit.alControl                        := memory.value.uint("al_control")
      unit.alStatus                         := memory.value.uint("al_status")
      unit.emulation                        := emulation
      unit.alControlWritten                 := alControl.map(writes(_).valid).reduce(_ || _)
      unit.alControlRead                    := alControl.map(hostReads).reduce(_ || _)
      memory.set.load("al_status").valid    := unit.copyControl
      memory.set.load("al_status").bits     := unit.alControl
      memory.guard.uint("al_control_free")  := unit.alControlFree
      memory.guard.uint("al_status_by_pdi") := !emulation
      unit.dlStatus                         := dlStatus
      unit.readDlStatus                     := processor.readDlStatus
      unit.readAlStatus                     := processor.readAlStatus
      unit.good                             := processor.frameGood
      unit.bad                              := processor.frameBad
      unit.ecatMask                         := memory.value.uint("ecat_event_mask")
      alChanged                             := unit.alStatus =/= RegNext(unit.alStatus)

      syncManagers match {
        case None =>
          unit.smEcatEvents := 0.U
          unit.smAlEvents   := 0.U
          unit.smChanged    := 0.U
        case Some(sms) =>
          unit.smEcatEvents := sms.ecatEvent.asUInt
          unit.smAlEvents   := sms.alEvent.asUInt
          unit.smChanged := VecInit((0 until p.syncManagers).map { n =>
            val address = SyncManagerRegisters.of(n) + SyncManagerRegisters.Activate
            val present =
              Cat(memory.value.uint(s"sm${n}_repeat_request"), memory.value.uint(s"sm${n}_enable"))
            val changed = RegInit(false.B).suggestName(s"sm${n}_changed") // reset: as the register
            val changes = writes(address).valid && writes(address).bits(1, 0) =/= present
            // A read is acknowledged a cycle late: a change in between it has not seen.
            when(hostReads(address) && !RegNext(changes, false.B)) { changed := false.B }
            when(changes) { changed := true.B }
            changed
          }).asUInt
      }
      unit.watchdog := watchdogs(dlStatus)
      unit.eeprom   := siiWaits

      // 0x0204, 0x0210, 0x0220 by their fields.
      def mask(name: String) = memory.value.uint(name)
      val smMask             = if (p.syncManagers > 0) mask("sm_mask") else 0.U(0.W)
      unit.alMask := Cat(
        smMask,
        0.U(1.W),
        mask("watchdog_mask"),
        mask("eeprom_mask"),
        mask("sm_activation_mask"),
        0.U(3.W),
        mask("al_control_mask")
      )
      status("dl_status_event")                    := unit.ecatEvents(2)
      status("al_status_event")                    := unit.ecatEvents(3)
      status("al_control_event")                   := unit.alEvents(0)
      status("sm_activation_event")                := unit.alEvents(4)
      if (p.hasWatchdogs) status("watchdog_event") := unit.alEvents(6)
      if (p.syncManagers > 0) {
        status("sm_ecat_event") := unit.ecatEvents >> 4
        status("sm_al_event")   := unit.alEvents >> 8
      }
      LocalSide.Events(unit.irqField, unit.irq)
    }

  /** Connects the smoke detector and the reports of what it sees; the result: a message waits for the host.
    *
    * @param links
    *   at the ports
    */
  def alarm(pins: AlarmPins, appender: DatagramAppender, links: Seq[Bool]): Bool = {
    val unit  = Module(new AlarmUnit(p)).suggestName("alarmUnit")
    val value = memory.value
    unit.pins <> pins
    unit.detect        := value.bool("detector_enable")
    unit.debounce      := value.uint("detector_debounce")
    unit.offTime       := value.uint("detector_off_time")
    unit.selfTest      := value.uint("self_test")
    unit.epoch         := value.uint("alarm_epoch")
    unit.node          := value.uint("station_alias")
    unit.registersBusy := memory.registersBusy
    for (
      (name, port) <- Seq(
        "detector_mode"    -> unit.mode,
        "detector_seconds" -> unit.seconds,
        "host_alive"       -> unit.hostAlive
      )
    ) {
      port.value            := value.uint(name)
      memory.set.load(name) := port.load
    }

    def changes(address: Int, bytes: Int) =
      (address until address + bytes).map(writes(_).valid).reduce(_ || _)
    // Orders stay as they were written last. Reset: 0, which is the number of no record; a life that ends.
    def kept(address: Int, field: Layout.Field): UInt = Cat((0 until field.bytes).reverse.map { i =>
      val byte = writes(address + field.offset + i)
      RegEnable(byte.bits, 0.U(8.W), byte.valid).suggestName(s"${field.name}_$i")
    })
    // All bytes are there a cycle after the last one is written.
    def comes(address: Int, bytes: Int) = RegNext(writes(address + bytes - 1).valid, false.B)
    val (acknowledge, confirm)          = (AlarmRegisters.Acknowledge, AlarmRegisters.Confirm)
    unit.acknowledge.valid         := comes(acknowledge, RecordAckLayout.bytes)
    unit.acknowledge.bits.sequence := kept(acknowledge, RecordAckLayout.Sequence)
    unit.acknowledge.bits.guard    := kept(acknowledge, RecordAckLayout.Guard)
    unit.acknowledge.bits.tag      := kept(acknowledge, RecordAckLayout.Tag)
    unit.acknowledgeChanges        := changes(acknowledge, RecordAckLayout.bytes)
    unit.confirm.valid             := comes(confirm, ConfirmLayout.bytes)
    unit.confirm.bits              := kept(confirm, ConfirmLayout.Number)
    unit.confirmChanges            := changes(confirm, ConfirmLayout.bytes)
    val life = kept(confirm, ConfirmLayout.Life)
    unit.newMaster := (0 until ConfirmLayout.Life.bytes)
      .map { i =>
        val byte = writes(confirm + ConfirmLayout.Life.offset + i)
        byte.valid && byte.bits =/= Lanes.byte(life, i)
      }
      .reduce(_ || _)
    for (register <- Seq(acknowledge, confirm); r <- AlarmRegisters.all if r.address == register)
      r.fields.foreach(f => status(f.name) := 0.U)
    unit.changes := RegNext(changes(AlarmRegisters.Debounce, 2), false.B)
    for ((name, action) <- Seq("alarm_silence" -> unit.silence, "detector_restart" -> unit.restart)) {
      action                      := value.bool(name)
      memory.set.load(name).valid := value.bool(name)
      memory.set.load(name).bits  := 0.U
    }

    appender.pending := unit.pending
    unit.busy        := appender.busy
    unit.nibble      := appender.nibble
    unit.nextWord    := appender.nextNibble >> 2
    appender.data    := unit.data
    unit.reads       := appender.reads
    unit.begins      := appender.begins
    unit.takes       := appender.takes

    status("slave_status")    := unit.status
    status("slave_node")      := unit.node
    status("slave_self_test") := unit.selfTest
    status("slave_epoch")     := unit.epoch
    status("slave_dropped")   := unit.dropped
    status("slave_links")     := VecInit(links).asUInt

    def message(name: String, address: Int): Bool = {
      val received = RegInit(false.B).suggestName(name) // reset: none
      // A read is acknowledged a cycle late: what came in between it has not seen.
      val comes = writes(address + AlarmRegisters.MessageBytes - 1).valid
      when(hostReads(AlarmRegisters.Messages) && !RegNext(comes, false.B)) { received := false.B }
      when(comes) { received := true.B }
      status(name) := received
      received
    }
    message("broadcast_received", AlarmRegisters.Broadcast) ||
    message("message_received", AlarmRegisters.Message)
  }

  /** Builds the watchdogs; the result: process data watchdog event. */
  private def watchdogs(dlStatus: UInt): Bool =
    if (!p.hasWatchdogs) false.B
    else {
      val divider = Module(new WatchdogDivider(p.cyclesPerNibble)).suggestName("watchdogDivider")
      divider.divider := memory.value.uint("watchdog_divider")
      def watchdog(time: String, address: Int, trigger: Bool) = {
        val unit = Module(new Watchdog).suggestName(s"watchdog_$time")
        unit.tick      := divider.tick
        unit.timeTicks := memory.value.uint(time)
        unit.trigger   := trigger
        unit.restart   := RegNext(writes(address).valid || writes(address + 1).valid, false.B)
        unit
      }
      val trigger     = syncManagers.fold(false.B)(_.trigger)
      val processData = watchdog("watchdog_time_process_data", WatchdogRegisters.TimeProcessData, trigger)
      val pdi         = watchdog("watchdog_time_pdi", WatchdogRegisters.TimePdi, memory.host.ack)
      status("watchdog_process_data")                   := processData.running
      status("watchdog_pdi")                            := pdi.running
      status("pdi_watchdog")                            := pdi.running
      memory.event.pulse("watchdog_count_process_data") := processData.expired
      memory.event.pulse("watchdog_count_pdi")          := pdi.expired
      watchdogExpired                                   := processData.expired
      processDataRuns                                   := processData.running
      pdiWatchdogExpired                                := pdi.expired
      val event   = RegInit(false.B).suggestName("watchdog_event") // reset: no event
      val status0 = WatchdogRegisters.StatusProcessData
      when(hostReads(status0) || hostReads(status0 + 1)) { event := false.B }
      when(processData.expired) { event := true.B }
      event
    }

  /** Connects the LEDs (LED-01 to LED-06). `active`: a frame comes or goes at the port. */
  def leds(pins: LedPins, links: Seq[Bool], active: Seq[Bool]): Unit = {
    val tick = Counter(p.coreClockMhz * 50000).inc()
    val al   = memory.value.uint("al_status")
    val state = MuxLookup(al(3, 0), LedCode.Off.U)(
      Seq(
        AlState.PreOperational  -> LedCode.Blinking,
        AlState.SafeOperational -> LedCode.Single,
        AlState.Operational     -> LedCode.On,
        AlState.Bootstrap       -> LedCode.Flicker
      ).map { case (s, c) => s.U -> c.U }
    )
    // Errors that are edges stay until the state changes.
    val latched = RegInit(LedCode.Off.U(4.W)) // reset: no error
    when(alChanged) { latched := LedCode.Off.U }
    when(watchdogExpired && al(3, 0) === AlState.Operational.U && latched =/= LedCode.On.U) {
      latched := LedCode.Double.U
    }
    when(pdiWatchdogExpired) { latched := LedCode.On.U }
    val error = Mux(
      siiError,
      LedCode.Flicker.U,
      Mux(latched =/= LedCode.Off.U, latched, Mux(al(4) && !emulation, LedCode.Single.U, LedCode.Off.U))
    )
    def led(name: String, automatic: UInt, address: Int, drop: Bool, pin: Bool): Unit = {
      val control = Module(new LedControl).suggestName(s"led_$name")
      val pattern = Module(new LedPattern).suggestName(s"pattern_$name")
      control.automaticCode         := automatic
      control.write                 := writes(address)
      control.drop                  := drop
      pattern.tick                  := tick
      pattern.code                  := control.code
      status(s"${name}_led_code")   := control.code
      status(s"${name}_led_enable") := control.taken
      pin                           := pattern.lit
    }
    led("run", Mux(siiLoading, LedCode.Flicker.U, state), LedRegisters.Run, alChanged, pins.run)
    led("err", error, LedRegisters.Err, error =/= LedCode.Off.U && error =/= RegNext(error), pins.err)
    for (((pin, link), traffic) <- pins.linkact.zip(links).zip(active)) {
      val unit = Module(new LinkActivity)
      unit.tick    := tick
      unit.link    := link
      unit.traffic := traffic
      pin          := unit.lit
    }
  }
}

object LocalSide {

  /** Events as the IRQ field of datagrams shows them, and whether the host is interrupted. */
  final case class Events(irqField: UInt, irq: Bool)
}
