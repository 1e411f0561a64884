package flyframe.protocol

/** A group of numbers with names. Each number is written down here only: RTL, model and server use the Scala
  * value, the firmware the same number from the generated header `protocol.h`.
  *
  * @param name
  *   of the group, the beginning of its names in the header; empty for numbers that belong to no group
  * @param meaning
  *   what the numbers say, a phrase for the header
  */
abstract class Codes(val name: String, val meaning: String) {
  private var listed = Vector.empty[Codes.Code]

  /** All numbers of the group. */
  def all: Seq[Codes.Code] = listed

  /** Adds a number to the group; the result is the number.
    *
    * @param name
    *   its name in the header, in lower case
    */
  protected def code(value: Int, name: String, meaning: String): Int = {
    require(!listed.exists(_.name == name), s"The name $name stands twice in ${this.name}.")
    listed :+= Codes.Code(name, value, meaning)
    value
  }
}

object Codes {

  /** A number, its name in the header, and what it says. */
  final case class Code(name: String, value: Int, meaning: String)

  /** Every group, in the order of the header. */
  def all: Seq[Codes] =
    Seq(
      ServerDatagram,
      Order,
      EventKind,
      CommandResult,
      SelfTest,
      DetectorState,
      DetectorMode,
      SlaveStatus,
      MasterStatus,
      RingPart,
      RingFlag,
      RingResult,
      RingStatus,
      Command,
      EtherType,
      AlState,
      LedCode,
      LoopSetting
    )
}
