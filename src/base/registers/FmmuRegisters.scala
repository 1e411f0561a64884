package flyframe.registers

import flyframe.params.EscParams
import RegisterTable._

/** The configuration of the FMMUs (FMMU-01); used by [[flyframe.fmmu.Fmmus]]. */
object FmmuRegisters {
  val First  = 0x0600
  val Stride = 16

  /** The first byte of FMMU `n`. */
  def of(n: Int): Int = First + Stride * n

  /** Where the byte that activates an FMMU stands among those of the FMMU. */
  val Activate = 12

  // format: off
  private def fmmu(n: Int, first: Int): Seq[Register] = Seq(
    register(first,            4, s"fmmu${n}_logical_start",  rw, r, "FMMU-01", "FMMU logical start address",
      field(s"fmmu${n}_logical_start",  31, 0, ram, 0, "First logical byte")),
    register(first + 4,        2, s"fmmu${n}_length",         rw, r, "FMMU-01", "FMMU length",
      field(s"fmmu${n}_length",         15, 0, ram, 0,
          "Logical bytes, from the first to the last with a mapped bit")),
    register(first + 6,        1, s"fmmu${n}_start_bit",      rw, r, "FMMU-01", "FMMU logical start bit",
      field(s"fmmu${n}_start_bit",       2, 0, ram, 0, "First mapped bit of the first logical byte")),
    register(first + 7,        1, s"fmmu${n}_stop_bit",       rw, r, "FMMU-01", "FMMU logical stop bit",
      field(s"fmmu${n}_stop_bit",        2, 0, ram, 0, "Last mapped bit of the last logical byte")),
    register(first + 8,        2, s"fmmu${n}_physical_start", rw, r, "FMMU-01", "FMMU physical start address",
      field(s"fmmu${n}_physical_start", 15, 0, ram, 0, "Local address of the first byte")),
    register(first + 10,       1, s"fmmu${n}_physical_bit",   rw, r, "FMMU-01", "FMMU physical start bit",
      field(s"fmmu${n}_physical_bit",    2, 0, ram, 0, "First bit in the first local byte")),
    register(first + 11,       1, s"fmmu${n}_type",           rw, r, "FMMU-01", "FMMU type",
      field(s"fmmu${n}_type",            1, 0, ram, 0, "Bit 0: for reads; bit 1: for writes")),
    register(first + Activate, 1, s"fmmu${n}_activate",       rw, r, "FMMU-01", "FMMU activate",
      field(s"fmmu${n}_activate",        0, 0, ram, 0, "1: active")),
    register(first + 13,       3, s"fmmu${n}_reserved",       r,  r, "FMMU-01", "FMMU reserved")
  )
  // format: on

  def apply(p: EscParams): Seq[Register] = for {
    n <- 0 until p.fmmus
    r <- fmmu(n, of(n))
  } yield r.copy(block = Some(Block(n, p.fmmus, Stride)))
}
