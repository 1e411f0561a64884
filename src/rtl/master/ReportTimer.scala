package flyframe.master

import chisel3._
import flyframe.protocol.MasterStatus

/** When a report is to be made (REP-03, REP-04): as soon as there is news, again while events are kept, and
  * as a heartbeat. One per millisecond may be made, and some more at once: news must not wait, and the
  * numbers of reports must last.
  */
class ReportTimer extends Module {

  /** The master may report. */
  val run = IO(Input(Bool()))

  /** One pulse every millisecond; after how many of them a report is repeated while events are `kept`, and
    * after how many else; from the last report on, or from its answer.
    */
  val millisecond = IO(Input(Bool()))
  val kept        = IO(Input(Bool()))
  val repeatMs    = IO(Input(UInt(12.W)))
  val heartbeatMs = IO(Input(UInt(12.W)))
  val answered    = IO(Input(Bool()))

  /** Something that the server should know now. A status that changes is news, too. */
  val news   = IO(Input(Bool()))
  val status = IO(Input(UInt(MasterStatus.Width.W)))

  /** A report is to be made; it begins. */
  val due    = IO(Output(Bool()))
  val begins = IO(Input(Bool()))

  private val fresh = RegInit(false.B)   // reset: nothing happened
  private val left  = RegInit(0.U(12.W)) // ms; reset: a first report at once
  private val may   = RegInit(7.U(3.W))  // reports that may be made at once; reset: the most
  private val isNow = left === 0.U
  due := run && may =/= 0.U && (fresh || isNow)
  when(millisecond && !isNow) { left := left - 1.U }
  may := may + (millisecond && !may.andR) - begins
  when(answered || begins) { left := Mux(kept, repeatMs, heartbeatMs) }
  when(begins) { fresh := false.B }
  when(news || status =/= RegNext(status, 0.U)) { fresh := true.B }
}
