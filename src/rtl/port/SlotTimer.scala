package flyframe.port

import chisel3._
import chisel3.util._

/** Divides the core clock into nibble slots of 40 ns, in step with the PHYs' clock.
  *
  * @param cyclesPerNibble
  *   core cycles per slot
  */
class SlotTimer(cyclesPerNibble: Int) extends Module {

  /** The PHYs' 25 MHz reference, from the same PLL as the core clock; its rising edge starts a slot. Tied
    * low: free running.
    */
  val reference = IO(Input(Bool()))

  /** One cycle per slot. */
  val tick = IO(Output(Bool()))

  if (cyclesPerNibble == 1) {
    tick := true.B // a slot is a cycle: nothing to align
  } else {
    val sampled = RegNext(reference)
    val before  = RegNext(sampled)
    val count   = RegInit(0.U(log2Ceil(cyclesPerNibble).W)) // reset: any phase will do
    count := Mux(count === (cyclesPerNibble - 1).U || (sampled && !before), 0.U, count + 1.U)
    tick  := count === 0.U
  }
}
