package flyframe.registers

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.model._
import flyframe.params.Presets
import flyframe.protocol.Command._
import flyframe.rules.{Reply, Steps}
import flyframe.{ControllerUnderTest, RtlBench, SharedSimulation}

/** Every byte of 0x0000 to 0x0FFF, from the bus and from the host, against what [[RegisterMap]] says of it,
  * and that against the register list of the reference.
  */
class RegisterWalkSpec extends AnyFlatSpec with SharedSimulation {
  private val small = Presets.named("cyclone4-min").get.params
  private val sets = Seq(
    small,
    small.copy(
      preset = "wide",
      dataBusWidth = 32,
      ports = 4,
      coreClockMhz = 25,
      nodeIdWidth = 10,
      maxSubTelegrams = 100
    ),
    // Everything but the EEPROM, whose configuration would not be that of the register table.
    Presets.named("slave").get.params.copy(preset = "complete", sii = 0),
    Presets
      .named("slave")
      .get
      .params
      .copy(preset = "complete-wide", sii = 0, dataBusWidth = 32, fmmus = 3, syncManagers = 12, ramKiB = 1),
    small.copy(preset = "clocks", clocks = 1, ports = 3),
    small.copy(
      preset = "sync",
      clocks = 2,
      syncSignals = 2,
      latchSignals = 2,
      eventTimes = 1,
      directSpeed = 1,
      acknowledgeByWrite = 1,
      applicationLayer = 1,
      syncManagers = 1
    )
  )

  // PHY management that the host only reads; the writes make it show the address of port 3.
  private val managed =
    small.copy(preset = "managed", coreClockMhz = 25, mi = 1, phyAddresses = 31 << 15 | 1 << 5)

  for (p <- sets :+ managed)
    together(p.preset, new ControllerUnderTest(p))(RegisterWalk.all.map { case (name, walk) =>
      name -> { dut: ControllerUnderTest => walk(new RegisterWalk(new RtlBench(dut, p))) }
    }: _*)

  /** Parameter sets whose register tables are compared with the list of the reference. */
  private val listed = Presets.all.map(_.params).filter(_.role == 0) ++ Seq(
    Presets.default.params.copy(preset = "clocks", clocks = 1),
    Presets.default.params
      .copy(preset = "sync", clocks = 2, syncSignals = 2, latchSignals = 2, eventTimes = 1),
    Presets.default.params
      .copy(preset = "time-by-pdi", clocks = 2, latchSignals = 1, timeByPdi = 1)
      .copy(directSpeed = 1, acknowledgeByWrite = 1),
    Presets.default.params.copy(preset = "emulation", sii = 2),
    Presets.default.params.copy(preset = "protected", writeProtection = 1),
    Presets.default.params.copy(preset = "general", generalOutputs = 8, generalInputs = 8, hostInterface = 1),
    Presets.named("et1100").get.params.copy(preset = "outputs", digitalOutputs = 4),
    Presets.default.params.copy(preset = "managed", mi = 2, miLinkDetection = 1, enhancedLinkDetection = 1)
  )

  /** Where a register is not as in the list, and why. */
  private val reasons = {
    val noBits     = "has bits that are none in the list"
    val otherReset = "is 0x1 after a reset, in the list another value"
    val absent     = "the loop of a port that does not exist is closed (LP-05)"
    val oneWritten = "of the four bytes only the first one is written, so that it is a register of its own"
    val whole      = "it takes its word of the EEPROM whole, reserved bits included (SII-07)"
    val ports =
      for (y <- 0 to 1; side <- Seq("ECAT", "PDI"))
        yield (
          s"mi_port$y",
          s"$side access is r/(w), in the list r and r/(clr)",
          "what a write clears is the business of its unit (LNK-05)"
        )
    val management =
      for (name <- Seq("mi_phy", "mi_register", "mi_data"))
        yield (name, "PDI access is r, in the list r/(w)", "with `mi` 1 the interface is the bus's alone")
    val others = Seq(
      ("features", noBits, "0x0008[15:13] are constants: a replay preset may report any value"),
      (
        "dl_configuration",
        noBits,
        "0x0100[23:20] take EEPROM bits, of which the list reserves three (SII-22)"
      ),
      (
        "dl_status",
        "ECAT access is r, in the list r/ack",
        "the register is only read; what a read acknowledges is an event of its unit (B-42)"
      ),
      ("loop_closed_port2", otherReset, absent),
      ("loop_closed_port3", otherReset, absent),
      ("esc_configuration_a5", noBits, whole),
      ("esc_configuration_a6", noBits, whole),
      ("esc_configuration_a6", "has 1 bytes, in the list 2", "the second byte has no content in the list"),
      ("pdi_configuration", noBits, whole),
      (
        "pdi_configuration",
        "has 2 bytes, in the list 1",
        "it includes 0x0151, the SYNC and LATCH configuration"
      ),
      (
        "eeprom_data",
        "has 2 bytes, in the list 8 or 4",
        "ECAT writes the first word only, so that the others are a register of their own"
      ),
      ("eeprom_data_high", "is not in the list", "it is the second part of 0x0508:0x050F"),
      ("eeprom_emulated", otherReset, "the emulation is a parameter"),
      ("pdi_error_code", noBits, "the list has rows for each interface, of which a parameter chooses"),
      ("general_input", "has 8 bytes, in the list ", "how many there are is a parameter"),
      ("device_emulation", otherReset, "without a host nobody else answers AL control (B-118)"),
      ("mi_link_detection", otherReset, "link detection through MI is a parameter"),
      ("receive_time_trigger", "has 1 bytes, in the list 4", oneWritten),
      ("receive_time_trigger", "ECAT access is rw, in the list rw/sf and r", oneWritten),
      ("receive_time_port0", "is not in the list", oneWritten),
      (
        "receive_time_processing_unit",
        "has 8 bytes, in the list ",
        "the list has two lengths for it, 4 and 8, of which a parameter chooses (DC-01)"
      )
    )
    val twoLengths = "the list has two lengths for it, 4 and 8, of which a parameter chooses (DC-01)"
    val byOne      = "a parameter tells which side has the time loop (B-112)"
    val clocks =
      Seq(
        "system_time_offset",
        "system_time_delay",
        "speed_counter_start",
        "time_filter_depth",
        "speed_filter_depth"
      )
        .flatMap(name =>
          Seq(
            (name, "ECAT access is rw, in the list r/(w)", byOne),
            (name, "ECAT access is r, in the list r/(w)", byOne),
            (name, "PDI access is rw, in the list r/(w)", byOne),
            (name, "PDI access is r, in the list r/(w)", byOne)
          )
        ) ++
        (Seq("system_time_offset", "start_time", "next_sync1") ++
          (for (n <- 0 to 1; edge <- Seq("positive", "negative")) yield s"latch${n}_${edge}_time"))
          .map((_, "has 8 bytes, in the list ", twoLengths)) ++ Seq(
          (
            "system_time",
            "ECAT access is rw, in the list r and - and (w)/sf",
            "the list has a row per side and view"
          ),
          ("system_time", "PDI access is rw, in the list - and r and (w)/sf", "the same of the host"),
          ("speed_counter_direct", "ECAT access is r, in the list r/(w)", byOne),
          ("speed_counter_direct", "PDI access is rw, in the list r/(w)", byOne),
          ("acknowledge_by_write", otherReset, "it is a parameter"),
          ("system_time_high", "is not in the list", "it is the second part of 0x0910, which is not written"),
          (
            "sync_pulse_length",
            "is 0x3e8 after a reset, in the list another value",
            "the pulse length is a parameter until the EEPROM is loaded"
          )
        )
    (ports ++ management ++ others ++ clocks).map { case (name, text, reason) =>
      RegisterList.Difference(name, text) -> reason
    }.toMap
  }

  "GEN-04, GEN-07, OP-01: every register" should
    "be that of the list in address, length, access, bits and reset value, but for the listed reasons" in {
      val found = for {
        p          <- listed
        register   <- RegisterMap(p) if !AlarmRegisters.all.contains(register)
        difference <- RegisterList.differences(register, p)
      } yield difference
      assert(found.toSet -- reasons.keySet == Set.empty, "have no reason")
      assert(reasons.keySet -- found == Set.empty, "are no differences: the reason is out of date")
    }

  "GEN-08: a controller with all units" should "have every register that the list calls mandatory" in {
    val complete = listed.filter(p => p.hasSii && p.hasApplicationLayer && p.hasWatchdogs)
    assert(complete.nonEmpty)
    for (p <- complete) {
      val registers = RegisterMap(p)
      val ports     = (p.ports until 4).map(0x0300 + 2 * _) // error counters of ports that do not exist
      assert(RegisterList.mandatory.filter(RegisterMap.covering(registers, _).isEmpty) == ports, p.preset)
    }
  }
}

object RegisterWalk {
  val all: Seq[(String, RegisterWalk => Unit)] = Seq(
    "GEN-07, GEN-09: every byte read by the host after reset"                          -> (_.hostReads()),
    "GEN-04, FP-28: every byte read from the bus after reset, one datagram each"       -> (_.busReads()),
    "FP-28: every byte read from the bus after reset, in long datagrams"               -> (_.longBusReads()),
    "FP-28, FP-32, GEN-09: every byte written from the bus with the complement"        -> (_.busWrites()),
    "PDI-06, GEN-09: every byte written by the host with the complement"               -> (_.hostWrites()),
    "ERR-10: every byte of an error counter written, which clears its group, no other" -> (_.counterWrites())
  )
}

/** The walks. Expectations come from the register map alone, not from the golden model. */
class RegisterWalk(bench: RtlBench) extends Steps(bench) {
  private val registers               = RegisterMap(p)
  private val end                     = RegisterMap.ProcessRamStart
  private def isUserRam(address: Int) = address >= RegisterMap.UserRamStart
  private def at(address: Int)        = RegisterMap.covering(registers, address)
  private def hex(address: Int)       = f"0x$address%04x"

  private def access(address: Int, side: Register => Access): Access =
    if (isUserRam(address)) Access.ReadWrite else at(address).fold[Access](Access.None)(side)
  private def ecat(address: Int) = access(address, _.ecat)
  private def pdi(address: Int)  = access(address, _.pdi)

  /** Changes with the loop settings, or moves them. */
  private def isDlControl(address: Int) = at(address).exists(_.name == "dl_control")

  /** The bits of a byte that belong to a field which `select` picks, taken from the fields' `image`. */
  private def bits(address: Int, select: Field => Boolean, image: Field => BigInt): Int =
    at(address).fold(0) { r =>
      val whole = r.fields.filter(select).map(f => image(f) << f.low).foldLeft(BigInt(0))(_ | _)
      (whole >> (8 * (address - r.address)) & 0xff).toInt
    }

  /** After reset, all links up, configuration loaded. */
  private def initial(address: Int): Int =
    if (isUserRam(address)) pattern(address)
    else
      bits(
        address,
        _ => true,
        f =>
          f.source match {
            case Source.Status     => if (isHigh(f)) 1 else f.reset
            case Source.Counter(_) => 0
            case _                 => f.reset
          }
      )

  /** Bits of units that are 1 once all links are up, the host has accessed something and the configuration is
    * loaded; the others read as their reset value.
    */
  private def isHigh(f: Field): Boolean =
    Seq(
      "pdi_operational",
      "pdi_active",
      "physical_link_port",
      "communication_port",
      "pdi_watchdog",
      "watchdog_pdi"
    )
      .exists(f.name.startsWith) || (f.name == "dl_status_event" && !linksSeen)

  /** A frame has read DL status, which ends the event of the links (B-42). */
  private var linksSeen = false

  /** A write has it changed to a time. */
  private def isTime(address: Int): Boolean = at(address).exists(_.fields.exists(_.source == Source.Kept()))

  /** It goes on by itself. */
  private def runs(address: Int): Boolean =
    at(address).exists(r => r.name == "system_time" || r.name == "system_time_high")

  /** Writing it decides which side may write others. */
  private def isOwner(address: Int): Boolean = at(address).exists(_.name == "cyclic_unit_control")

  /** The host may write it as long as the units belong to ECAT. */
  private def pdiMay(address: Int): Boolean =
    pdi(address).writable && !at(address).exists(_.pdiGuard.exists(_.endsWith("_of_pdi")))

  /** Status bits that show what was written. */
  private def showsWritten(f: Field): Boolean =
    f.name.matches("(run|err)_led_.*|sm\\d+_deactivated|mi_data|cyclic_active|sync\\d_enable")

  /** The bits of a byte that keep what is written. */
  private def stored(address: Int): Int =
    if (isUserRam(address)) 0xff
    else
      bits(
        address,
        f =>
          f.source match {
            case _: Source.Stored | Source.Ram | Source.Kept(true, _) => true
            case _                                                    => showsWritten(f)
          },
        f => (BigInt(1) << f.width) - 1
      )

  private def written(address: Int, byte: Int): Int =
    byte & stored(address) | initial(address) & ~stored(address)

  /** User RAM is undefined at power-on: a pattern without two equal neighbours. */
  private def pattern(address: Int): Int = (address * 7 + 3) & 0xff
  private def fillUserRam(): Unit =
    for (address <- RegisterMap.UserRamStart until end) bench.hostWrite(address, pattern(address))

  /** One frame to port 0; with all loops closed it leaves there again. */
  private def exchanged(datagrams: Seq[Datagram]): Seq[Reply] = {
    val (port, sent) = bench.send(0, WireFrame.withFcs(EtherCatFrame(datagrams))).get
    replies(good(Some(port -> sent), port))
  }
  private def several(datagrams: Seq[Datagram]): Seq[Reply] =
    datagrams.grouped(p.maxSubTelegrams min 100).flatMap(exchanged).toSeq

  /** What every byte of `range` reads from the bus; `filler` where it cannot be read. */
  private def busRead(range: Seq[Int], filler: Int): Seq[Int] =
    range.grouped(1400).flatMap(r => read(Aprd, 0, r.head, filler, r.size)).toSeq
  private def read(command: Int, adp: Int, ado: Int, filler: Int, length: Int): Seq[Int] =
    exchanged(Seq(Datagram(command, adp, ado, Seq.fill(length)(filler)))).head.data

  def hostReads(): Unit = {
    fillUserRam()
    for (address <- 0 until end if !runs(address))
      assert(bench.hostRead(address) == (if (pdi(address).readable) initial(address) else 0), hex(address))
  }

  def busReads(): Unit = {
    fillUserRam()
    val filler = 0xa6 // no register reads so
    val found  = several((0 until end).map(a => Datagram(Aprd, 0, a, Seq(filler))))
    for ((reply, address) <- found.zipWithIndex) {
      val can = ecat(address).readable
      if (address / (p.maxSubTelegrams min 100) > 0x111 / (p.maxSubTelegrams min 100)) linksSeen = true
      assert(reply.workingCounter == (if (can) 1 else 0), hex(address))
      if (!runs(address))
        assert(reply.data == Seq(if (can) initial(address) else filler), hex(address))
    }
  }

  def longBusReads(): Unit = {
    fillUserRam()
    for (filler <- Seq(0x00, 0xff)) { // bytes that cannot be read stay as they were sent
      for ((byte, address) <- busRead(0 until end, filler).zipWithIndex if !runs(address))
        assert(byte == (if (ecat(address).readable) initial(address) else filler), hex(address))
      linksSeen = true
    }
  }

  def busWrites(): Unit = {
    fillUserRam()
    def write(address: Int, byte: Int) = Datagram(Apwr, 0, address, Seq(byte))
    var closed: Set[String]            = Set.empty // guards that earlier frames have closed
    var refused: Set[Int]              = Set.empty
    def may(address: Int)              = ecat(address).writable && !refused(address)
    def check(address: Int, reply: Reply): Unit = {
      if (at(address).flatMap(_.ecatGuard).exists(closed)) refused += address
      assert(reply.workingCounter == (if (may(address)) 1 else 0), hex(address))
    }
    def after(address: Int) =
      (if (may(address)) written(address, ~initial(address) & 0xff) else initial(address)) ^
        reactions(address)

    /** What the units show after all this. */
    def reactions(address: Int): Int = bits(
      address,
      f =>
        f.name == "al_control_event" || f.name == "sm_activation_event" || f.name == "mi_command_error" ||
          f.name == "mi_port_address" || f.name.matches(
            "sm\\d+_last_buffer"
          ),
      f => (BigInt(1) << f.width) - 1 // all are mailboxes now
    )

    val (loops, others) = (0 until end).partition(a => isDlControl(a) || isOwner(a))
    others.grouped(p.maxSubTelegrams min 100).foreach { group =>
      exchanged(group.map(a => write(a, ~initial(a) & 0xff))).zip(group).foreach { case (reply, a) =>
        check(a, reply)
      }
      for (a <- group; r <- at(a))
        if (r.name == "al_control" && !refused(a)) closed += "al_control_free"
        else if (r.name.endsWith("_activate")) closed += r.name.replace("activate", "disabled")
    }
    // Loop settings and owners take effect at once, so one byte at a time, and back.
    for (address <- loops) {
      check(address, exchanged(Seq(write(address, ~initial(address) & 0xff))).head)
      assert(read(Aprd, 0, address, 0, 1) == Seq(after(address)), hex(address))
      check(address, exchanged(Seq(write(address, initial(address)))).head)
      assert(read(Aprd, 0, address, 0, 1) == Seq(initial(address)), hex(address))
    }
    val now = busRead(0 until end, 0)
    for (address <- others if !isTime(address))
      assert(now(address) == (if (ecat(address).readable) after(address) else 0), hex(address))
    linksSeen = true
    // AL control is read last: that ends its event.
    for (
      address <- others.sortBy(a => at(a).exists(r => r.pdi == Access.ReadAcknowledge))
      if pdi(address).readable && !isTime(address)
    )
      assert(bench.hostRead(address) == after(address), hex(address))
  }

  def hostWrites(): Unit = {
    fillUserRam()
    for (address <- 0 until end) bench.hostWrite(address, ~initial(address) & 0xff)
    def now(address: Int, alSeen: Boolean) =
      if (pdiMay(address)) written(address, ~initial(address) & 0xff)
      else initial(address) ^ bits(address, f => f.name == "al_status_event" && !alSeen, _ => 1)
    for ((byte, address) <- busRead(0 until end, 0).zipWithIndex if !runs(address))
      assert(byte == (if (ecat(address).readable) now(address, alSeen = false) else 0), hex(address))
    linksSeen = true
    for (address <- 0 until end if !runs(address)) {
      val expected = if (pdi(address).readable) now(address, alSeen = true) else 0
      assert(bench.hostRead(address) == expected, hex(address))
    }
  }

  def counterWrites(): Unit = {
    val counters = registers.flatMap(r => r.fields.map(r -> _)).collect {
      case (r, f @ Field(_, _, _, Source.Counter(group), _, _)) => (r.address + f.low / 8, group)
    }
    val other = EtherCatFrame(Seq(Datagram(Nop, 0, 0, Seq(0))))
    val wrong = Fcs.of(other).map(_ ^ 0x10)

    def allCount(): Unit = {
      for (y <- 0 until p.ports) {
        bench.setLink(y, up = false)
        bench.setLink(y, up = true)
        bench.falseCarrier(y, 1)
        bench.send(y, WireFrame.ofBytes(other ++ wrong))
        bench.send(y, WireFrame(WireFrame.ofBytes(other ++ wrong).symbols :+ Symbol(0)))
      }
      if (p.hasWatchdogs) { // both expire soon after this, and then have time
        assert(put(0x0400, 0, 0) && put(0x0410, 1, 0) && put(0x0420, 1, 0))
        bench.hostRead(0)
        assert(put(0x1000, 1, 2))
        bench.idle(100)
        assert(put(0x0400, 0xc2, 0x09) && put(0x0410, 0xff, 0xff) && put(0x0420, 0xff, 0xff))
      }
    }
    if (p.hasWatchdogs) syncManager(0, 0x1000, 2, 0x44)
    for ((address, group) <- counters) {
      allCount()
      for ((a, _) <- counters) assert(bench.hostRead(a) > 0, s"${hex(a)} counts")
      assert(write(Apwr, 0, address, 0xff).workingCounter == 1)
      for ((a, g) <- counters)
        assert((bench.hostRead(a) == 0) == (g == group), s"${hex(a)} after writing ${hex(address)}")
    }
  }
}
