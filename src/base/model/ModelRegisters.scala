package flyframe.model

import flyframe.params.EscParams
import flyframe.registers.{Access, Field, Register, RegisterMap, Source}

/** The registers of a modelled controller: values by field name, access by byte.
  *
  * @param status
  *   gives the value of a status field by its name
  * @param added
  *   registers beside those of the units
  */
class ModelRegisters(p: EscParams, status: String => Int, added: Seq[Register] = Nil) {
  private val registers: Seq[Register] = RegisterMap(p, added)
  private val fields                   = registers.flatMap(_.fields)
  private val byByte: Array[Register] = {
    val table = new Array[Register](RegisterMap.UserRamStart)
    registers.foreach(r => r.range.foreach(table(_) = r))
    table
  }
  private val values = scala.collection.mutable.Map.from(fields.map(f => f.name -> f.reset.toLong))

  def register(address: Int): Option[Register] =
    if (address >= 0 && address < byByte.length) Option(byByte(address)) else None

  /** Bytes of the register with this name. */
  def bytes(name: String): Int = registers.find(_.name == name).fold(0)(_.bytes)

  private val firstManaged   = RegisterMap.firstManaged(registers)
  private val unmanagedWords = RegisterMap.unmanagedWords(registers).toSet

  /** SyncManagers act on this address (B-52). */
  def isManaged(address: Int): Boolean = address >= firstManaged && !unmanagedWords(address / 4)

  /** There is a field of this name. */
  def has(name: String): Boolean = values.contains(name)

  /** Present value of a field. */
  def value(name: String): Int            = values(name).toInt
  def wide(name: String): Long            = values(name)
  def set(name: String, value: Int): Unit = setWide(name, value.toLong)
  def setWide(name: String, value: Long): Unit = {
    require(
      values.contains(name),
      s"The field is called $name but must be one of ${fields.map(_.name).mkString(", ")}."
    )
    values(name) = value
  }

  /** Counts one, up to 0xFF (ERR-10). */
  def count(name: String, events: Int = 1): Unit = values(name) = (values(name) + events) min 0xffL

  /** The byte at `address` as it reads; reserved bits and absent bytes are 0. */
  def byte(address: Int): Int = register(address).fold(0) { r =>
    val whole = r.fields.foldLeft(0L) { (image, f) =>
      val v = f.source match {
        case Source.Status | Source.Kept(_, true) => status(f.name) & 0xffffffffL
        case _                                    => values(f.name)
      }
      image | v << f.low
    }
    (whole >> (8 * (address - r.address)) & 0xff).toInt
  }

  /** A write takes effect, for the bits in `mask` of the byte. */
  def write(address: Int, byte: Int, mask: Int = 0xff): Unit = register(address).foreach { r =>
    val first = 8 * (address - r.address) // lowest bit of this byte in the register
    r.fields.foreach { f =>
      f.source match {
        case _: Source.Stored | Source.Ram | Source.Kept(true, _) =>
          for (
            bit <- f.low to f.high if bit >= first && bit < first + 8 && (mask >> (bit - first) & 1) == 1
          ) {
            val here = 1L << (bit - f.low)
            val one  = (byte >> (bit - first) & 1) == 1
            values(f.name) = if (one) values(f.name) | here else values(f.name) & ~here
          }
        case Source.Counter(group) => clear(group)
        case _                     =>
      }
    }
  }

  private def clear(group: String): Unit = fields.foreach { f: Field =>
    if (f.source == Source.Counter(group)) values(f.name) = 0
  }

  def ecat(address: Int): Access = register(address).fold[Access](Access.None)(_.ecat)
  def pdi(address: Int): Access  = register(address).fold[Access](Access.None)(_.pdi)

  /** All bytes of existing registers. */
  def addresses: Seq[Int] = registers.flatMap(_.range)
}
