package flyframe.master

import chisel3._

/** Counts pulses, but not while somebody reads the count byte by byte: then a pulse waits. Reset: 0.
  *
  * @param width
  *   bits of the count
  */
class HeldCounter(width: Int) extends Module {
  val count = IO(Input(Bool()))

  /** It must not change; not for as long as two pulses may be apart. */
  val holds = IO(Input(Bool()))
  val value = IO(Output(UInt(width.W)))

  private val number = RegInit(0.U(width.W))
  private val waits  = RegInit(false.B) // a pulse; reset: none
  value := number
  waits := Mux(holds, count || waits, count && waits)
  when(!holds && (count || waits)) { number := number + 1.U }
}
