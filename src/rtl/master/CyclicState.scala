package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.protocol.SlaveStatus

/** What the master knows of fire from what comes back in every cycle (LM-05, LM-06). It stands beside the
  * log: nothing that fills up can keep an alarm from it, and what is lost comes again in the next cycle.
  */
class CyclicState extends Module {

  /** The status words of all slaves that a frame has reached, together. */
  val answer = IO(Flipped(Valid(UInt(16.W))))

  /** The cycle is over; true: every end of the line that was in use has answered. */
  val over = IO(Flipped(Valid(Bool())))

  /** Pulses: an alarm record is new; the sounder of a slave has gone on. */
  val newAlarm = IO(Input(Bool()))
  val newSound = IO(Input(Bool()))

  /** Pulses: what people want. */
  val silence    = IO(Input(Bool()))
  val resetAlarm = IO(Input(Bool()))

  /** A reset that was asked for before does not count any more; orders have been given up before they had
    * arrived everywhere.
    */
  val expires = IO(Input(Bool()))
  val givenUp = IO(Input(Bool()))

  val fire       = IO(Output(Bool()))
  val sounding   = IO(Output(Bool()))
  val alarm      = IO(Output(Bool()))
  val slaveFault = IO(Output(Bool()))
  val disabled   = IO(Output(Bool()))
  val testing    = IO(Output(Bool()))

  private class Seen extends Bundle {
    val sounding, smoke, alarm, fault, disabled, testing = Bool()
  }
  private def of(word: UInt): Seen = {
    def has(bits: Int) = (word & bits.U).orR
    val seen           = Wire(new Seen)
    seen.sounding := has(SlaveStatus.Sounding)
    seen.smoke    := has(SlaveStatus.Alarm | SlaveStatus.Latched)
    seen.alarm    := has(SlaveStatus.Alarm)
    seen.fault    := has(SlaveStatus.Faults)
    seen.disabled := has(SlaveStatus.Disabled)
    seen.testing  := has(SlaveStatus.Testing)
    seen
  }
  private def none       = 0.U.asTypeOf(new Seen)
  private val came       = of(answer.bits)
  private val now        = RegInit(none)    // of this cycle's answers; reset: none
  private val last       = RegInit(none)    // of the last cycle, and what is new since; reset: all is well
  private val isFire     = RegInit(false.B) // reset: quiet
  private val isLoud     = RegInit(false.B)
  private val wantsReset = RegInit(false.B) // reset: nobody does
  fire       := isFire
  sounding   := isLoud
  alarm      := last.alarm
  slaveFault := last.fault
  disabled   := last.disabled
  testing    := last.testing

  when(over.valid) {
    now := none
    when(over.bits) {
      last := now
      when(!now.smoke && wantsReset) {
        isFire     := false.B
        wantsReset := false.B
      }
    }
  }
  when(expires) { wantsReset := false.B }
  when(silence || resetAlarm) { isLoud := false.B }
  when(resetAlarm) { wantsReset := true.B }
  when(answer.valid) {
    now  := (now.asUInt | came.asUInt).asTypeOf(new Seen)
    last := (last.asUInt | came.asUInt).asTypeOf(new Seen)
    when(came.smoke) { isFire := true.B }
  }
  // Who was not reached sounds still: that is heard anew.
  when(givenUp) {
    last.sounding := false.B
    now.sounding  := false.B // else it would be the last one when this cycle is over
  }
  private val rises = answer.valid && came.sounding && !last.sounding
  private val heard = newAlarm && now.sounding // else it is a record of times past
  when(rises || newSound || heard) {
    isLoud     := true.B
    wantsReset := false.B // that was asked for before this alarm
  }
}
