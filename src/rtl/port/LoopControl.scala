package flyframe.port

import chisel3._
import chisel3.util._
import flyframe.params.EscParams
import flyframe.protocol.LoopSetting

/** Decides which loops are open (LP-01 to LP-06) and when they change (B-30). */
class LoopControl(p: EscParams) extends Module {
  private val n = p.ports

  val link    = IO(Input(Vec(n, Bool())))
  val setting = IO(Input(Vec(n, UInt(2.W))))

  /** The loop settings were written (B-33). */
  val settingWritten = IO(Input(Bool()))

  /** A frame without error came in at the port. */
  val goodFrame = IO(Input(Vec(n, Bool())))

  /** Neither the port's receiver nor the path through its loop carries a frame. */
  val quiet = IO(Input(Vec(n, Bool())))

  /** Frames leave and enter at this port. */
  val open = IO(Output(Vec(n, Bool())))

  /** The loop state for DL status: closed even where port 0 is open only as recovery port (LP-06). */
  val reportClosed = IO(Output(Vec(n, Bool())))

  /** The loop of port 0 is closed by itself (LP-14). */
  val circulating = IO(Output(Bool()))

  private val wanted = VecInit((0 until n).map { y =>
    // Auto close: opened by a write or a good frame since the link came up (LP-03, LP-04). Reset: not opened.
    val released = RegInit(false.B).suggestName(s"released_$y")
    released := link(y) && (released || settingWritten || goodFrame(y))
    MuxLookup(setting(y), link(y))(
      Seq(
        LoopSetting.AutoClose.U -> (link(y) && released),
        LoopSetting.Open.U      -> true.B,
        LoopSetting.Closed.U    -> false.B
      )
    )
  })

  private val recovery = !wanted.asUInt.orR
  for (y <- 0 until n) {
    val now = RegInit(false.B).suggestName(s"open_$y") // reset: closed until the link is known
    when(quiet(y)) { now := wanted(y) || (if (y == 0) recovery else false.B) }
    open(y)         := now
    reportClosed(y) := !(now && wanted(y))
  }
  circulating := !open(0) && (setting(0) === LoopSetting.Auto.U || setting(0) === LoopSetting.AutoClose.U)
}
