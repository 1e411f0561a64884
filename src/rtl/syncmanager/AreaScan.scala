package flyframe.syncmanager

import chisel3._

/** Where an address lies among the SyncManagers' areas. */
class AreaHit(indexBits: Int) extends Bundle {
  val hit   = Bool()
  val index = UInt(indexBits.W)
  val first = Bool()
  val last  = Bool()
}

/** One entry of the SyncManager table on its way through the scan. */
class AreaEntry(indexBits: Int) extends Bundle {
  val index = UInt(indexBits.W)
  val start = UInt(16.W)

  /** Bytes of the area: one buffer, or all three of a locked one (SM-27). */
  val extent = UInt(18.W)

  /** Working or locked. */
  val takesPart = Bool()

  /** It does for ECAT that reads; one whose deactivation is delayed does not (SM-30). */
  val takesReads = Bool()

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

  private val stage    = RegNext(entry)
  private val distance = RegNext(address -& entry.start) // bit 16: below the start
  // Bytes behind this one; bit 18 not set: it lies beyond the end.
  private val left = stage.extent +& ~distance(15, 0).pad(18)

  private val found = Reg(new AreaHit(indexBits))
  when(stage.begins || !found.hit) {
    found.hit   := stage.takesPart && !distance(16) && left(18)
    found.index := stage.index
    found.first := !distance(15, 0).orR
    found.last  := !left(17, 0).orR
  }
  result := found
}

object AreaScan {

  /** The lowest-numbered hit of all banks. */
  def lowest(results: Seq[AreaHit]): AreaHit = results.reduceRight((low, high) => Mux(low.hit, low, high))
}
