package flyframe.relay

import flyframe.can.{BitSetting, BitStream, BitTimingModel}

/** The bits of a link (FR-40): a quantum is a core cycle, the sample point lies at 64 to 68 % (RB-05).
  *
  * @param cycles
  *   core cycles of a bit, 25 (2 Mbit/s at 50 MHz) to 250 (400 kbit/s at 100 MHz)
  */
final case class LinkTiming(cycles: Int) {
  require(
    cycles >= LinkTiming.Least && cycles <= LinkTiming.Most,
    s"cycles is $cycles but must be ${LinkTiming.Least} to ${LinkTiming.Most} core cycles."
  )

  /** Cycles from the edge at the start of a bit to its sample. */
  val sample: Int = cycles * 41 / 64

  /** Greatest change by a resynchronisation. */
  val jump: Int = cycles * 3 / 16

  val setting: BitSetting = BitSetting(tseg1 = sample, tseg2 = cycles - 1 - sample, sjw = jump)
}

object LinkTiming {
  val Least = 25
  val Most  = 250

  /** Frames of 8 bytes a second at 2 Mbit/s that may be relied on, with the worst stuffing; figures at a load
    * are relative to it. A ring whose nodes send all they can carries more.
    */
  val FullLoad = 8400

  /** Core cycles of a bit at 2 Mbit/s, the shortest one (RB-26). */
  def least(coreClockMhz: Int): Int = Least max coreClockMhz / 2
}

/** A link receiver behind its bit timing, core cycle by core cycle. */
class LinkInputModel(timing: LinkTiming, receiver: LinkReceiverModel) extends BitStream {
  private val bits = new BitTimingModel(timing.setting, this)

  def begins(): Unit              = ()
  def samples(bit: Boolean): Unit = receiver.take(bit)
  def isHard: Boolean             = receiver.isIdle
  def hardSynchronises(): Unit    = ()
  def level: Boolean              = true // a link has one sender: nothing of the own is heard

  /** A core cycle ends in which `heard` was heard. */
  def step(heard: Boolean): Unit = bits.quantum(heard)
}
