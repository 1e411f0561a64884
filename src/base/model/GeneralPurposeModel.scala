package flyframe.model

/** General purpose inputs as their register shows them (PDI-10); outputs are no more than a register. */
class GeneralPurposeModel extends ModelUnit {

  /** The levels at the pins. */
  var inputs: Long = 0

  override def status(field: String): Option[Int] = field match {
    case "general_input"      => Some(inputs.toInt)
    case "general_input_high" => Some((inputs >> 32).toInt)
    case _                    => None
  }
}
