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
  def addressBits(p: EscParams): Int = if (p.isMaster) 8 else 12

  private def ofSlave(p: EscParams): Seq[Register] = {
    def where(built: Boolean)(table: => Seq[Register]) = if (built) table else Nil
    InformationRegisters(p) ++ StationRegisters(p) ++ DlRegisters(p) ++ ErrorCounters(p) ++
      where(p.hasApplicationLayer)(ApplicationRegisters.all ++ EventRegisters(p)) ++
      where(p.hasWatchdogs)(WatchdogRegisters.all) ++
      where(p.hasLeds)(LedRegisters.all) ++
      where(p.hasSii)(SiiRegisters(p)) ++
      where(p.digitalOutputs > 0)(DigitalOutputRegisters(p)) ++
      where(p.hasAlarm)(AlarmRegisters.all) ++
      FmmuRegisters(p) ++ SyncManagerRegisters(p)
  }

  /** All registers that exist with parameters `p`, in address order, without overlap.
    *
    * @param added
    *   registers that a product has beside those of the units; see `CONTRIBUTING.md`
    */
  def apply(p: EscParams, added: Seq[Register] = Nil): Seq[Register] = {
    val registers = ((if (p.isMaster) MasterRegisters(p) else ofSlave(p)) ++ added).sortBy(_.address)
    registers.zip(registers.drop(1)).foreach { case (a, b) =>
      require(a.address + a.bytes <= b.address, s"registers ${a.name} and ${b.name} overlap")
    }
    require(registers.last.address + registers.last.bytes <= UserRamStart, "register beyond 0x0F7F")
    val names = registers.flatMap(_.fields.map(_.name))
    require(
      names.distinct.size == names.size,
      s"two fields are called ${names.diff(names.distinct).mkString(", ")}"
    )
    if (!p.isMaster) checkSlave(p, registers)
    registers
  }

  private def checkSlave(p: EscParams, registers: Seq[Register]): Unit = {
    val inRam  = registers.filter(_.inRam)
    val places = inRam.flatMap(_.range.map(ramIndex))
    require(places.distinct.size == places.size, "two registers at one place of the register RAM")
    for (r <- registers) {
      require(!r.inRam || p.hasRegisterRam, s"register ${r.name} is in RAM but there is no register RAM")
      require(!r.inRam || r.reset == 0, s"register ${r.name} is in RAM, which is 0 after a reset")
      require(
        !r.bitWritable || p.hasBitWrites || !p.hasBitwiseFmmus,
        s"register ${r.name} is written bit by bit, which takes digitalOutputs"
      )
    }
    val unmanaged = unmanagedWords(registers).toSet
    for (r <- registers if r.managed)
      require(
        !r.range.exists(a => unmanaged(a / 4)),
        s"register ${r.name} shares a word of four bytes with one that SyncManagers do not act on"
      )
  }

  /** The register that covers `byteAddress`, if it exists. */
  def covering(registers: Seq[Register], byteAddress: Int): Option[Register] =
    registers.find(_.covers(byteAddress))

  // ---- SyncManagers ----

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

  // ---- register RAM ----

  /** A part of the register RAM: what stands at the addresses that begin as `start` does, but for the lowest
    * `bits`, is kept from `index` on by these lowest bits.
    */
  final case class RamArea(start: Int, bits: Int, index: Int) {
    require(
      start % (1 << bits) == 0 && index % (1 << bits) == 0,
      f"area of the register RAM for 0x$start%04x"
    )
    def holds(address: Int): Boolean = address >> bits == start >> bits
    def range: Range                 = start until start + (1 << bits)
  }

  /** The areas of equal units in the register RAM, 512 bytes. */
  val FmmuArea: RamArea        = RamArea(FmmuRegisters.First, 8, 0)
  val SyncManagerArea: RamArea = RamArea(SyncManagerRegisters.First, 7, 0x100)

  /** All other registers in RAM, by the low seven bits of their address; `start` is what the RTL clears them
    * by.
    */
  val OtherArea: RamArea = RamArea(0x0500, 7, 0x180)

  /** Where the register RAM keeps the byte at `address`. */
  def ramIndex(address: Int): Int = {
    val area = Seq(FmmuArea, SyncManagerArea).find(_.holds(address)).getOrElse(OtherArea)
    area.index | (address & ((1 << area.bits) - 1))
  }

  /** Bits that exist of the byte at `address` in the register RAM. */
  def ramMask(registers: Seq[Register], address: Int): Int =
    covering(registers, address).fold(0)(r => (r.mask >> (8 * (address - r.address)) & 0xff).toInt)
}
