package flyframe.registers

/** Finds registers and fields by the names that they have in their tables. A name that is in no table ends
  * the program.
  */
class RegisterNames(registers: Seq[Register]) {
  private val byName = registers.map(r => r.name -> r).toMap
  private val places = (for (r <- registers; f <- r.fields) yield f.name -> FieldPlace(r, f)).toMap

  /** The register of that name. */
  def register(name: String): Register = found("register", byName, name)

  /** The field of that name, wherever it is. */
  def field(name: String): FieldPlace = found("field", places, name)

  /** The field is built. */
  def has(field: String): Boolean = places.contains(field)

  private def found[T](what: String, all: Map[String, T], name: String): T = {
    require(
      all.contains(name),
      s"the $what is called $name but must be one of ${all.keys.toSeq.sorted.mkString(", ")}."
    )
    all(name)
  }
}

/** A field and the register that it is in. */
final case class FieldPlace(register: Register, field: Field) {

  /** The addresses of the bytes that hold bits of it, ascending. */
  def bytes: Range = register.address + field.low / 8 to register.address + field.high / 8

  /** The address of the only byte that holds bits of it, and which of that byte's bits these are. */
  def byte: Int = {
    require(
      bytes.size == 1,
      s"field ${field.name} has bits ${field.high} to ${field.low} but must be within one byte."
    )
    bytes.head
  }

  /** Its highest and lowest bit within their bytes. */
  def high: Int = field.high % 8
  def low: Int  = field.low  % 8
}
