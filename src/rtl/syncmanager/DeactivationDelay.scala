package flyframe.syncmanager

import chisel3._
import chisel3.util._

/** A SyncManager that the master switches off still works for the host, which may be reading the last buffer
  * (SM-29 to SM-31, B-102).
  */
class DeactivationDelay extends Module {

  /** The host wants that (0x0807[6]), has not deactivated the SyncManager, and there is something to read. */
  val isOn = IO(Input(Bool()))

  /** 0x0806[0] as it is written, and as it is. */
  val enable     = IO(Input(Valid(UInt(1.W))))
  val wasEnabled = IO(Input(Bool()))

  /** No frame is in the processing unit: none sees the end of the delay half way. */
  val noFrame = IO(Input(Bool()))

  /** Start, length or control are written. */
  val changes = IO(Input(Bool()))

  /** It works for the host although it is switched off. */
  val active = IO(Output(Bool()))

  /** It has been switched on again, and begins anew: one cycle. */
  val restarts = IO(Output(Bool()))

  private val lingers = RegInit(false.B) // reset: nothing is switched on
  private val again   = enable.valid && enable.bits.asBool
  when(isOn && enable.valid && !enable.bits.asBool && wasEnabled) { lingers := true.B }
  when(again || changes || (!isOn && noFrame)) { lingers := false.B }
  active   := lingers
  restarts := RegNext(again && lingers, false.B) // reset: nothing is switched on
}
