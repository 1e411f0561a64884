package flyframe.registers

import flyframe.params.EscParams

/** Puts the tables of all units together and checks that they fit; says what else lies in the address space.
  */
object RegisterMap {

  /** First byte of user RAM (GEN-04). */
  val UserRamStart = 0x0f80

  /** First byte of process data RAM (GEN-04). */
  val ProcessRamStart = 0x1000

  /** Bits of the byte address of a register. */
  def addressBits(p: EscParams): Int =
    if (p.isMaster) 8 else if (p.hasPlant) 13 else if (p.isRing && !p.hasRelay) 11 else 12

  private def ofSlave(p: EscParams): Seq[Register] = {
    def where(built: Boolean)(table: => Seq[Register]) = if (built) table else Nil
    InformationRegisters(p) ++ StationRegisters(p) ++ DlRegisters(p) ++ ErrorCounters(p) ++
      where(p.countsHostErrors)(HostErrorRegisters.all) ++
      where(p.hasApplicationLayer)(ApplicationRegisters(p) ++ EventRegisters(p)) ++
      where(p.hasWatchdogs)(WatchdogRegisters.all) ++
      where(p.hasLeds)(LedRegisters.all) ++
      where(p.hasSii)(SiiRegisters(p)) ++
      where(p.hasResetRegisters)(ResetRegisters.all) ++
      where(p.hasWriteProtection)(ProtectionRegisters.all) ++
      where(p.hasMi)(MiRegisters(p)) ++ where(p.hasMiLinks)(MiRegisters.ports(p)) ++
      where(p.digitalOutputs > 0)(DigitalOutputRegisters(p)) ++
      GeneralPurposeRegisters(p) ++
      where(p.hasClocks)(ClockRegisters(p)) ++
      where(p.hasAlarm)(AlarmRegisters.all) ++
      FmmuRegisters(p) ++ SyncManagerRegisters(p)
  }

  /** All registers that exist with parameters `p`, in address order, without overlap.
    *
    * @param added
    *   registers that a product has beside those of the units; see `CONTRIBUTING.md`
    */
  def apply(p: EscParams, added: Seq[Register] = Nil): Seq[Register] = {
    val units     = if (p.isMaster) MasterRegisters(p) else if (p.isRing) NodeRegisters(p) else ofSlave(p)
    val registers = (units ++ added).sortBy(_.address)
    val end       = if (p.role == 0) UserRamStart else 1 << addressBits(p)
    for (r <- registers)
      require(
        r.address >= 0 && r.address + r.bytes <= end,
        s"${r.place} but must be at ${hex(0 until end)}."
      )
    registers.zip(registers.drop(1)).foreach { case (a, b) =>
      require(
        a.address + a.bytes <= b.address,
        f"${b.place} but must be at 0x${a.address + a.bytes}%04x or above, as ${a.name} is in front of it."
      )
    }
    val names = registers.flatMap(_.fields.map(_.name))
    for (name <- names.diff(names.distinct))
      require(
        requirement = false,
        s"field $name stands in ${names.count(_ == name)} places of the registers but must stand in 1."
      )
    if (p.role == 0) {
      checkSlave(p, registers)
      checkManaged(registers)
      checkAdded(p, added)
      checkRam(p, registers, added)
    }
    registers
  }

  private def hex(range: Range): String = f"0x${range.head}%04x to 0x${range.last}%04x"

  private def checkSlave(p: EscParams, registers: Seq[Register]): Unit = for (r <- registers) {
    require(
      !r.bitWritable || p.hasBitWrites || !p.hasBitwiseFmmus,
      s"register ${r.name} is bitWritable, for which digitalOutputs is ${p.digitalOutputs} but must " +
        "be 1 to 4."
    )
    if (r.inRam) {
      require(
        p.hasRegisterRam,
        s"register ${r.name} has ram fields but must have none, as the parameters build no register RAM."
      )
      require(
        r.reset == 0,
        s"register ${r.name} has ram fields and reset value ${r.reset} but must have reset value 0."
      )
      // The RTL masks reserved bits of FMMUs only, with those of the first FMMU for all.
      require(
        RegisterRam.Fmmus.holds(r.address) || r.mask == (BigInt(1) << (8 * r.bytes)) - 1,
        s"register ${r.name} has ram fields in ${r.mask.bitCount} bits but must have them in all " +
          s"${8 * r.bytes}."
      )
    }
  }

  /** The RTL compares whole words in front of the user RAM. */
  private def checkManaged(registers: Seq[Register]): Unit = {
    val unmanaged = unmanagedWords(registers).toSet
    for (r <- registers if r.managed) {
      require(
        ManagedRange.contains(r.address) && ManagedRange.contains(r.range.last),
        s"${r.place} and managed but must be at ${hex(ManagedRange)}."
      )
      require(
        Integer.bitCount(r.bytes) == 1,
        s"register ${r.name} is managed and has ${r.bytes} bytes but must have 1, 2, 4, 8, 16, 32, 64 or 128."
      )
      require(
        r.address % r.bytes == 0,
        s"${r.place} and managed but must be at a multiple of its ${r.bytes} bytes."
      )
      for (a <- r.range.find(a => unmanaged(a / 4)))
        require(
          requirement = false,
          f"${r.place} and managed but must be outside of 0x${a / 4 * 4}%04x to " +
            f"0x${a / 4 * 4 + 3}%04x, a word with a register that is not."
        )
    }
  }

  /** The RTL clears the register RAM, and the SII unit writes to it, by the addresses of its areas; for
    * registers there, these are writes like all others. Of blocks it decodes and keeps those of the units.
    */
  private def checkAdded(p: EscParams, added: Seq[Register]): Unit = for (r <- added) {
    for (b <- r.block)
      require(
        requirement = false,
        s"register ${r.name} is one of ${b.count} in a block but must be in none, as only FMMUs and " +
          "SyncManagers are."
      )
    if (p.hasRegisterRam)
      require(
        !r.range.exists(a => RegisterRam.areas.exists(_.holds(a))),
        s"${r.place} but must be outside of ${RegisterRam.areas.map(a => hex(a.range)).mkString(", ")}, " +
          "by which the register RAM is cleared."
      )
  }

  /** A register in RAM has its place there to itself. */
  private def checkRam(p: EscParams, registers: Seq[Register], added: Seq[Register]): Unit = {
    val stored   = registers.filter(_.inRam)
    val reserved = if (p.hasSii) SiiRegisters.Scratch else 0 until 0
    for (r <- stored; a <- r.range)
      require(
        !reserved.exists(RegisterRam.index(_) == RegisterRam.index(a)),
        s"${r.place} and in RAM but must not have the low seven bits of ${hex(reserved)}, where the " +
          "SII unit keeps its own."
      )
    val writers = ramBytes(p, registers).groupMap { case (_, a) => RegisterRam.index(a) } { case (r, _) => r }
    for (r <- stored; a <- r.range; other <- writers(RegisterRam.index(a)) if other != r) {
      val (told, there) = if (added.contains(r)) (r, other) else (other, r)
      require(
        requirement = false,
        f"${told.place}, where writes of it reach the register RAM, but must not have the low seven " +
          f"bits 0x${a & 0x7f}%02x, which are those of ${there.place}."
      )
    }
  }

  /** The bytes, with their registers, whose writes reach the register RAM: those in RAM, and, as the RTL
    * tells them by words of `dataBusWidth`, all others in a word with one of them that a side or unit writes.
    * These write a place that nobody reads, unless it is that of another register.
    */
  private def ramBytes(p: EscParams, registers: Seq[Register]): Seq[(Register, Int)] = {
    val words = registers.filter(_.inRam).flatMap(_.range.map(_ / p.lanes)).toSet
    for {
      r <- registers if r.inRam || r.stores || r.ecat.writable || r.pdi.writable
      a <- r.range if words(a / p.lanes)
    } yield (r, a)
  }

  /** The register that covers `byteAddress`, if it exists. */
  def covering(registers: Seq[Register], byteAddress: Int): Option[Register] =
    registers.find(_.covers(byteAddress))

  // ---- SyncManagers ----

  /** Where registers may be `managed`: as many bytes as the user RAM has, in front of it. */
  val ManagedRange: Range = UserRamStart - (ProcessRamStart - UserRamStart) until UserRamStart

  /** First address that SyncManagers act on (B-52). They do so from there on up, but for [[unmanagedWords]].
    */
  def firstManaged(registers: Seq[Register]): Int =
    registers.filter(_.managed).map(_.address).minOption.getOrElse(UserRamStart)

  /** Words of four bytes, by a fourth of their address, behind `firstManaged` that SyncManagers do not act on
    * since they hold a register that is not `managed`. Whole words, as a host reaches four bytes at once.
    */
  def unmanagedWords(registers: Seq[Register]): Seq[Int] = registers
    .filter(r => !r.managed && r.range.last >= firstManaged(registers))
    .flatMap(_.range.map(_ / 4))
    .distinct
}
