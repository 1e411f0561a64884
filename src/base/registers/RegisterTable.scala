package flyframe.registers

/** The words that the tables of registers are written in: a row for each register, below it a row for each of
  * its fields. A table imports all of them; its columns are the parameters of [[register]] and [[field]].
  */
object RegisterTable {

  /** What one side may do with a register, and under which condition it may write. */
  final case class Side(access: Access, guard: Option[String] = None)
  val no: Side  = Side(Access.None)
  val r: Side   = Side(Access.Read)
  val rw: Side  = Side(Access.ReadWrite)
  val ack: Side = Side(Access.ReadAcknowledge)
  val clr: Side = Side(Access.ReadClear)

  /** Reading always, writing while the condition of this name holds. */
  def rwIf(guard: String): Side = Side(Access.ReadGuardedWrite, Some(guard))

  // Where the value of a field comes from, see Source.
  val constant: Source               = Source.Constant
  val stored: Source                 = Source.Stored()
  val loadable: Source               = Source.Stored(hardwareSet = true)
  val mirrored: Source               = Source.Stored(mirrored = true)
  val status: Source                 = Source.Status
  val ram: Source                    = Source.Ram
  val kept: Source                   = Source.Kept()
  val keptWritten: Source            = Source.Kept(written = true)
  val keptStatus: Source             = Source.Kept(shown = true)
  def counter(group: String): Source = Source.Counter(group)

  /** The row of a register.
    *
    * @param address
    *   first byte
    * @param bytes
    *   how many it has
    * @param ecat
    *   what the bus may do with it
    * @param pdi
    *   the same for the host
    * @param rule
    *   the rules of the specification that it implements
    * @param title
    *   its name for people
    */
  def register(
      address: Int,
      bytes: Int,
      name: String,
      ecat: Side,
      pdi: Side,
      rule: String,
      title: String,
      fields: Field*
  ): Register =
    Register(name, title, address, bytes, ecat.access, pdi.access, rule, fields, ecat.guard, pdi.guard)

  /** The row of a field: bits `high` to `low` of its register, its value after a reset, what it means. */
  def field(name: String, high: Int, low: Int, source: Source, reset: BigInt, meaning: String): Field =
    Field(name, high, low, source, reset, meaning)
}
