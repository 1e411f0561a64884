package flyframe.can

import flyframe.registers.{CanRegisters, Field, Register, Source}

/** The register map of a port as bytes: what is stored there, and the status that the port puts between
  * (CB-11, CB-12). Whatever stands in no register reads 0 and ignores writes.
  */
class CanMemoryModel(registers: Seq[Register]) {
  private val stored = Array.fill(CanMemoryModel.End)(0)
  private val byAddress: Array[Option[Register]] = {
    val table = Array.fill(CanMemoryModel.End)(Option.empty[Register])
    for (r <- registers; a <- r.range) table(a) = Some(r)
    table
  }
  private val places = (for (r <- registers; f <- r.fields) yield f.name -> (r -> f)).toMap
  private val waits  = Array.fill(CanRegisters.FilterCommit)(0) // bytes of an entry of the filters

  private def bitsOf(r: Register, address: Int, isStored: Boolean): Int =
    r.fields
      .filter(f => CanMemoryModel.isStored(f.source) == isStored)
      .map(f => (f.mask >> 8 * (address - r.address) & 0xff).toInt)
      .foldLeft(0)(_ | _)

  private val writable: Array[Int] =
    byAddress.zipWithIndex.map { case (r, a) => r.fold(0)(bitsOf(_, a, isStored = true)) }

  /** The fields that are not stored, of each byte. */
  private val shown: Array[Seq[Field]] = byAddress.zipWithIndex.map { case (r, a) =>
    r.toSeq
      .flatMap(r => r.fields.filter(f => (f.mask >> 8 * (a - r.address) & 0xff) != 0))
      .filterNot(f => CanMemoryModel.isStored(f.source))
  }

  /** The register with the byte at `address`. */
  def register(address: Int): Option[Register] = byAddress.lift(address).flatten

  /** The byte as it is stored; status is 0. */
  def byte(address: Int): Int = stored(address)

  def bytes(address: Int, count: Int): Seq[Int] = stored.toSeq.slice(address, address + count)

  /** The value of a stored field. */
  def value(name: String): Int = {
    val (r, f) = places(name)
    val all    = r.range.map(a => BigInt(stored(a)) << 8 * (a - r.address)).sum
    ((all & f.mask) >> f.low).toInt
  }

  /** A byte is written to its stored bits. */
  def write(address: Int, byte: Int): Unit = stored(address) = byte & writable(address)

  /** A byte of an entry of the filters: it waits for the last one. */
  def writeFilter(address: Int, byte: Int): Unit = {
    val within = address % CanRegisters.FilterBytes
    if (within < CanRegisters.FilterCommit) waits(within) = byte
    else {
      for (i <- waits.indices) write(address - within + i, waits(i))
      write(address, byte)
    }
  }

  /** The port itself writes, where the host may not. */
  def put(address: Int, bytes: Seq[Int]): Unit = for ((b, i) <- bytes.zipWithIndex) stored(address + i) = b

  /** A byte of a register, of which `status` gives the fields that are not stored. */
  def read(r: Register, address: Int, status: String => BigInt): Int = {
    val value = shown(address).map(f => status(f.name) << f.low).sum
    stored(address) | (value >> 8 * (address - r.address) & 0xff).toInt
  }
}

object CanMemoryModel {

  /** Behind the last address of the ports. */
  val End = 0x0800

  /** Time stamps of slots stand in the memory, too. */
  private def isStored(source: Source): Boolean = source match {
    case _: Source.Stored | _: Source.Kept => true
    case _                                 => false
  }
}
