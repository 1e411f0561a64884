package flyframe.registers

/** Where registers stand that block RAM keeps, 512 bytes of it. */
object RegisterRam {

  /** A part of the register RAM: what stands at the addresses that begin as `start` does, but for the lowest
    * `bits`, is kept from `index` on by these lowest bits.
    */
  final case class Area(start: Int, bits: Int, index: Int) {
    require(
      start % (1 << bits) == 0 && index % (1 << bits) == 0,
      f"area of the register RAM has start 0x$start%04x and index 0x$index%03x but both must be " +
        f"multiples of ${1 << bits}."
    )
    def holds(address: Int): Boolean = address >> bits == start >> bits
    def range: Range                 = start until start + (1 << bits)
  }

  /** The areas of equal units. */
  val Fmmus: Area        = Area(FmmuRegisters.First, 8, 0)
  val SyncManagers: Area = Area(SyncManagerRegisters.First, 7, 0x100)

  /** All other registers in RAM, by the low seven bits of their address; `start` is what the RTL clears them
    * by.
    */
  val Others: Area = Area(0x0500, 7, 0x180)

  /** All areas. */
  def areas: Seq[Area] = Seq(Others, Fmmus, SyncManagers)

  /** Where the register RAM keeps the byte at `address`. */
  def index(address: Int): Int = {
    val area = Seq(Fmmus, SyncManagers).find(_.holds(address)).getOrElse(Others)
    area.index | (address & ((1 << area.bits) - 1))
  }

  /** Bits that exist of the byte at `address` in the register RAM. */
  def mask(registers: Seq[Register], address: Int): Int =
    RegisterMap
      .covering(registers, address)
      .fold(0)(r => (r.mask >> (8 * (address - r.address)) & 0xff).toInt)
}
