package flyframe.model

import flyframe.params.EscParams
import flyframe.registers.{DlRegisters, EventRegisters, Register, RegisterMap, ResetRegisters}

/** What lies at the local addresses: memory, registers and the units behind them, as the host and as ECAT
  * reach it.
  *
  * @param portStatus
  *   gives the value of a status field of the ports
  * @param added
  *   registers of a product beside those of the units
  * @param addedUnits
  *   the units behind them
  * @param phys
  *   gives what the management bus leads to
  */
class LocalSpace(
    p: EscParams,
    eeprom: Option[Seq[Int]],
    portStatus: String => Int,
    added: Seq[Register] = Nil,
    addedUnits: Seq[ModelUnit] = Nil,
    phys: () => PhyBus = () => PhyBus.Empty
) {
  private val memory = new Array[Int](0x10000)

  /** Process data RAM is open (FP-31). */
  var pdiOperational: Boolean = true

  val registers: ModelRegisters = new ModelRegisters(p, status, added)

  private def emulation = p.isDigitalIo || (p.hasSii && registers.value("device_emulation") == 1)

  val watchdogs: Option[WatchdogModel] = Option.when(p.hasWatchdogs)(
    new WatchdogModel(registers, watchdog => leds.foreach(_.watchdogExpired(watchdog)))
  )
  val application: Option[ApplicationModel] = Option.when(p.hasApplicationLayer)(
    new ApplicationModel(
      registers,
      () => emulation,
      () => word(DlRegisters.Status)
    )
  )
  val syncManagers: SyncManagerBank =
    new SyncManagerBank(
      p,
      registers,
      exists,
      () => triggers(),
      event => clock.foreach(_.happens(event))
    )
  private val sii = Option.when(p.hasSii)(
    new SiiModel(registers, eeprom, p.hasEmulation, () => pdiOperational, () => pdiOperational = true)
  )
  private val management =
    Option.when(p.hasMi)(new MiiManagementModel(p, registers, phys))
  private val reset      = Option.when(p.hasResetRegisters)(new ResetModel)
  private val protection = Option.when(p.hasWriteProtection)(new ProtectionModel(registers))
  private val leds =
    Option.when(p.hasLeds)(new LedModel(registers, () => emulation, () => sii.exists(_.loadFailed)))

  val alarm: Option[AlarmModel] = Option.when(p.hasAlarm)(
    new AlarmModel(
      registers,
      () => (0 until p.ports).map(y => portStatus(s"physical_link_port$y") << y).sum
    )
  )

  val clock: Option[ClockModel] = Option.when(p.hasClocks)(
    new ClockModel(p, registers, y => portStatus(s"physical_link_port$y") == 1, n => digital.sync(n))
  )

  val digital: DigitalModel = new DigitalModel(
    p,
    registers,
    () => pdiOperational,
    () => watchdogs.forall(_.processData.alive),
    hostWrite(_, _)
  )

  val hostErrors: Option[HostErrorModel] = Option.when(p.countsHostErrors)(new HostErrorModel(registers))

  val generalPurpose: GeneralPurposeModel = new GeneralPurposeModel

  private val units: Seq[ModelUnit] =
    watchdogs.toSeq ++ application ++ Seq(
      syncManagers
    ) ++ sii ++ management ++ reset ++ protection ++ leds ++ clock ++
      clock.toSeq.flatMap(_.signals) ++ alarm ++ hostErrors ++ Seq(generalPurpose) ++ addedUnits

  if (p.hasEmulation) pdiOperational = false
  else if (eeprom.isDefined) sii.foreach(s => pdiOperational = s.loadFirst())

  private def status(field: String): Int = units.iterator
    .map(_.status(field))
    .collectFirst { case Some(v) => v }
    .getOrElse(field match {
      case "pdi_operational" | "pdi_active" => if (pdiOperational) 1 else 0
      case "pdi_configured"                 => if (pdiOperational && p.hasSii) 1 else 0
      case _                                => portStatus(field)
    })

  /** Enhanced link detection is on at this port (LNK-11). */
  def enhancedLink(port: Int): Boolean = sii.forall { s =>
    val a0 = registers.value("esc_configuration") << 1
    !s.firstFailed && ((a0 >> 1 & 1) == 1 || (a0 >> (4 + port) & 1) == 1)
  }

  /** The condition of the register at `address` holds, if it has one. */
  private def allowed(address: Int)(guard: Register => Option[String]): Boolean =
    registers.register(address).flatMap(guard).forall(name => units.exists(_.guard(name).contains(true)))
  private def isPresent(address: Int): Boolean = allowed(address)(_.present)

  private def isMemory(address: Int): Boolean =
    (address >= RegisterMap.UserRamStart && address < RegisterMap.ProcessRamStart) ||
      (pdiOperational && address >= RegisterMap.ProcessRamStart &&
        address < RegisterMap.ProcessRamStart + p.ramBytes)

  /** There is something for a SyncManager: memory, or a register that it acts on. */
  private def exists(address: Int): Boolean =
    isMemory(address) || registers.register(address).exists(_.managed)

  /** Where an access leads after the SyncManagers: an address, or nowhere if it is denied or absent. */
  private def passed(side: Side, write: Boolean, address: Int): Option[Int] =
    if (address > 0xffff) None
    else if (!registers.isManaged(address)) Some(address)
    else
      syncManagers.owner(side, write, address) match {
        case Some(manager) =>
          val place = manager.access(side, write, address)
          syncManagers.settle()
          place
        case None => Option.when(exists(address))(address)
      }

  /** Something triggers the process data watchdog (WD-04). */
  private def triggers(): Unit = {
    watchdogs.foreach(_.processData.trigger())
    digital.triggers()
  }

  private def store(address: Int, byte: Int, bits: Int, byHost: Boolean): Unit = {
    registers.write(address, byte, bits)
    registers.register(address).foreach(r => units.foreach(_.written(r, address, byte, byHost)))
    if (p.outputsTrigger && registers.register(address).exists(_.name == "digital_output")) triggers()
  }

  // ---- local side ----

  /** A byte as the host reads it, with what reading does; 0 where nothing is, or if it is denied. */
  def hostRead(address: Int): Int = hostRead(address, bytes = 1).head

  /** The bytes from `address` on as the host reads them in one access, which triggers the PDI watchdog when
    * it ends: it sees that watchdog as it was (B-62).
    */
  def hostRead(address: Int, bytes: Int): Seq[Int] = {
    clock.foreach(_.hostReads(address))
    val values = (0 until bytes).map(i => hostReadByte(address + i))
    reset.foreach(_.otherCommand())
    watchdogs.foreach(_.pdi.trigger())
    watch()
    values
  }

  private def hostReadByte(address: Int): Int =
    passed(Side.Pdi, write = false, address).fold(0) { local =>
      if (isMemory(local)) memory(local)
      else if (!registers.pdi(local).readable || !isPresent(local)) 0
      else {
        syncManagers.reader = Side.Pdi
        val byte = registers.byte(local)
        syncManagers.reader = Side.Ecat
        if (!p.acknowledgesByWrite) acknowledge(local)
        byte
      }
    }

  private def acknowledge(local: Int): Unit =
    registers.register(local).foreach(r => units.foreach(_.acknowledged(r, local)))

  def hostWrite(address: Int, byte: Int): Unit = {
    if (address != ResetRegisters.Pdi) reset.foreach(_.otherCommand())
    passed(Side.Pdi, write = true, address).foreach { local =>
      if (isMemory(local)) memory(local) = byte
      else if (registers.pdi(local).writable && isPresent(local) && allowed(local)(_.pdiGuard))
        store(local, byte, 0xff, byHost = true)
      if (p.acknowledgesByWrite) acknowledge(local)
    }
    watchdogs.foreach(_.pdi.trigger())
    watch()
  }

  /** Something may have changed DL status, or be an error. */
  def watch(): Unit = {
    application.foreach(_.watchDlStatus())
    digital.watch()
    leds.foreach(_.watch())
  }

  /** The byte at `address` tells a time, which the model does not know to the nanosecond. */
  def isTime(address: Int): Boolean = alarm.exists(_.isTime(address)) || clock.exists(_.isTime(address))

  // ---- ECAT ----

  /** Time passes, in ns, for the local clock and for commands to PHYs. */
  def advance(ns: Long): Unit = {
    clock.foreach(_.advance(ns))
    management.foreach(_.advance(ns))
  }

  /** What passed the processing unit had no SFD; a frame it was all the same. */
  def frameWithoutSfd(): Unit = {
    digital.frameBegins()
    reset.foreach(_.frameStarts())
    protection.foreach(_.frameStarts())
  }

  /** The frame that now enters the processing unit. */
  class Frame extends AddressSpace {
    private var pending = Vector.empty[(Int, Int, Int)]
    private var read    = Set.empty[Int]
    private var command = 0

    /** It has read of a time ([[isTime]]). */
    var hasTime = false
    digital.frameBegins()
    syncManagers.frameStarts()
    reset.foreach(_.frameStarts())
    protection.foreach(_.frameStarts())
    management.foreach(_.frameStarts())
    clock.foreach(_.processingBegins())

    override def executes(now: Int): Unit = command = now

    def read(address: Int): Option[Int] = passed(Side.Ecat, write = false, address).flatMap { local =>
      if (isMemory(local)) Some(memory(local))
      else
        Option.when(registers.ecat(local).readable && isPresent(local)) {
          read += local
          if (isTime(local)) hasTime = true
          registers.byte(local)
        }
    }

    def claim(address: Int): Option[(Int, Int) => Boolean] =
      if (protection.exists(_.refuses(address))) None else claimed(address)

    private def claimed(address: Int): Option[(Int, Int) => Boolean] =
      passed(Side.Ecat, write = true, address).flatMap { local =>
        if (isMemory(local)) Some((byte, _) => { memory(local) = byte; true })
        else
          Option.when(
            registers.ecat(local).writable && isPresent(local) && allowed(local)(_.ecatGuard)
          ) { (byte: Int, bits: Int) =>
            val may = pending.size < p.writeLogDepth // B-17
            if (may) clock.foreach(_.isWritten(local, command))
            if (may) protection.foreach(_.passes(local))
            if (may)
              pending :+= (local, byte, if (registers.register(local).exists(_.bitWritable)) bits else 0xff)
            may
          }
      }

    override def closings(): () => Unit = {
      val due = syncManagers.managers.filter(_.takeClosing())
      () => due.foreach(_.close())
    }

    /** FP-32, FP-35: the frame is over; what it wrote to registers, in order. */
    def end(good: Boolean): Seq[Int] = {
      syncManagers.frameEnds(good)
      clock.foreach(_.frameEnds(good))
      if (!good) Nil
      else {
        read.flatMap(registers.register(_)).foreach(r => units.foreach(_.readByEcat(r)))
        pending.foreach { case (address, byte, bits) => store(address, byte, bits, byHost = false) }
        clock.foreach(_.compare())
        sii.foreach(_.frameEnds())
        management.foreach(_.frameEnds())
        digital.frameEnds()
        pending.map(_._1)
      }
    }
  }

  /** Bus or host ask for a reset (SYS-04). */
  def resetRequested: Boolean = reset.exists(_.requested)

  /** What goes into the IRQ field of datagrams (B-43). */
  def ecatEvents: Int =
    if (p.hasApplicationLayer) word(EventRegisters.EcatRequest) & word(EventRegisters.EcatMask) else 0

  /** The level of the interrupt to the host (IRQ-01). */
  def interrupt: Boolean =
    alarm.exists(_.interrupt) ||
      (p.hasApplicationLayer && Seq(0, 2).exists { half =>
        (word(EventRegisters.AlRequest + half) & word(EventRegisters.AlMask + half)) != 0
      })

  private def word(address: Int): Int = registers.byte(address) | registers.byte(address + 1) << 8
}
