package flyframe.application

import chisel3._
import flyframe.clocks.LevelCrossing
import flyframe.memory.{RegisterBus, RegisterUnit}
import flyframe.params.EscParams
import flyframe.registers.GeneralPurposeRegisters

/** General purpose outputs and inputs: whole bytes, each bit by itself. */
class GeneralPurposePins(p: EscParams) extends Bundle {
  val output = Option.when(p.generalOutputs > 0)(Output(UInt((8 * p.generalOutputs).W)))
  val input  = Option.when(p.generalInputs > 0)(Input(UInt((8 * p.generalInputs).W)))
}

/** General purpose outputs and inputs behind registers: no watchdog, no consistency (PDI-10). */
class GeneralPurposeIo(p: EscParams, pins: GeneralPurposePins)
    extends RegisterUnit(GeneralPurposeRegisters(p)) {
  def connect(bus: RegisterBus): Unit = {
    pins.output.foreach(_ := bus.value("general_output"))
    for (pins <- pins.input) {
      val levels = VecInit(pins.asBools.map(LevelCrossing(_))).asUInt
      bus.status("general_input")                               := levels
      if (p.generalInputs > 4) bus.status("general_input_high") := levels >> 32
    }
  }
}
