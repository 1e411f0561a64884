package flyframe.port

import chisel3._
import chisel3.util._
import flyframe.params.EscParams

/** Brings the loop settings back some time after a temporary setting (0x0100[1], B-31). */
class TemporaryLoops(p: EscParams) extends Module {
  private val n = p.ports

  /** The register writes of a frame are about to take effect; `setting` still holds the old loop settings. */
  val commitStarts = IO(Input(Bool()))
  val setting      = IO(Input(Vec(n, UInt(2.W))))
  val temporary    = IO(Input(Bool())) // 0x0100[1]

  /** Load the former settings, and 0 into 0x0100[1]. */
  val restore = IO(Output(Bool()))
  val former  = IO(Output(Vec(n, UInt(2.W))))

  private val cycles  = p.coreClockMhz.toLong * 1000 * p.temporaryLoopMs
  private val counter = Reg(UInt(log2Ceil(cycles + 1).W))
  private val saved   = Reg(Vec(n, UInt(2.W)))

  when(!temporary) { counter := (cycles - 1).U }.otherwise { counter := counter - 1.U }
  when(commitStarts && !temporary) { saved := setting }
  restore := temporary && counter === 0.U
  former  := saved
}
