package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** General purpose outputs and inputs (PDI-10); used by [[flyframe.application.GeneralPurposeIo]]. */
object GeneralPurposeRegisters {
  val Outputs = 0x0f10
  val Inputs  = 0x0f18

  // format: off
  def apply(p: EscParams): Seq[Register] =
    Option.when(p.generalOutputs > 0)(
      register(Outputs, p.generalOutputs, "general_output", rw, rw, "PDI-10, FP-37",
          "General purpose outputs",
        field("general_output", 8 * p.generalOutputs - 1, 0, stored, 0, "Levels of the outputs"))
    ).toSeq ++ Option.when(p.generalInputs > 0)(
      register(Inputs,  p.generalInputs,  "general_input",  r,  r,  "PDI-10",        "General purpose inputs",
        Seq(field("general_input", (8 * p.generalInputs - 1) min 31, 0, status, 0, "Levels of the inputs")) ++
          Option.when(p.generalInputs > 4)(
      field("general_input_high",   8 * p.generalInputs - 1, 32, status, 0, "Levels of further inputs")): _*)
    )
  // format: on
}
