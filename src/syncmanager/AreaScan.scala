package flyframe.syncmanager

import chisel3._

/** Where an address lies among the SyncManagers' areas. */
class AreaHit(indexBits: Int) extends Bundle {
  val hit   = Bool()
  val index = UInt(indexBits.W)

  /** Length of a buffer. */
  val length = UInt(16.W)
  val first  = Bool()
  val last   = Bool()
}

/** One entry of the SyncManager table on its way through the scan. */
class AreaEntry(indexBits: Int) extends Bundle {
  val index  = UInt(indexBits.W)
  val start  = UInt(16.W)
  val length = UInt(16.W)

  /** Working or locked; all three buffers count (SM-27). */
  val takesPart = Bool()
  val triple    = Bool()

  /** First entry of a scan. */
  val begins = Bool()
}

/** Compares an address with one entry per cycle and keeps the lowest-numbered hit (B-51).
  *
  * `hit` is final two cycles after the last entry.
  */
class AreaScan(indexBits: Int) extends Module {
  val entry   = IO(Input(new AreaEntry(indexBits)))
  val address = IO(Input(UInt(16.W)))
  val result  = IO(Output(new AreaHit(indexBits)))

  // The distance from the start, and the length to compare with.
  private val difference = address -& entry.start // bit 16: below the start
  private val limit      = entry.length +& Mux(entry.triple, entry.length << 1, 0.U(17.W))
  private val stage      = RegNext(entry)
  private val distance   = RegNext(difference)
  private val limitStage = RegNext(limit.pad(18))

  private val inside = stage.takesPart && !distance(16) && distance(15, 0) < limitStage
  private val found  = Reg(new AreaHit(indexBits))
  when(stage.begins || !found.hit) {
    found.hit    := inside
    found.index  := stage.index
    found.length := stage.length
    found.first  := distance(15, 0) === 0.U
    found.last   := distance(15, 0) + 1.U === stage.length
  }
  result := found
}

object AreaScan {

  /** The lowest-numbered hit of all banks. */
  def lowest(results: Seq[AreaHit]): AreaHit = results.reduceRight((low, high) => Mux(low.hit, low, high))
}
