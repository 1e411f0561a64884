package flyframe.model

import flyframe.registers.{Register, ResetRegisters}

/** The reset sequences of bus and host (SYS-04, B-72). */
class ResetModel extends ModelUnit {
  private val complete = ResetRegisters.Sequence.size
  private var ecat     = 0
  private var pdi      = 0
  private var added    = false // the frame has written a value

  /** The reset is asked for; nothing but a reset ends that. */
  def requested: Boolean = ecat == complete || pdi == complete

  private def after(progress: Int, byte: Int, may: Boolean): Int =
    if (progress == complete) complete
    else if (may && byte == ResetRegisters.Sequence(progress)) progress + 1
    else 0

  /** A frame comes: the one before it has gone on with the sequence, or ended it. */
  def frameStarts(): Unit = {
    if (!added && ecat < complete) ecat = 0
    added = false
  }

  /** The host accesses something else. */
  def otherCommand(): Unit = if (pdi < complete) pdi = 0

  override def status(field: String): Option[Int] = field match {
    case "reset_ecat" => Some(ecat)
    case "reset_pdi"  => Some(pdi)
    case _            => None
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit =
    register.name match {
      case "reset_ecat" =>
        ecat = after(ecat, byte, !added)
        added = true
      case "reset_pdi" => pdi = after(pdi, byte, may = true)
      case _           =>
    }
}
