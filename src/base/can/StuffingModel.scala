package flyframe.can

/** Counts equal bits, and so tells where a stuff bit stands (CAN-09). */
class StuffingModel {
  private var run  = 0
  private var last = true

  /** SOF is the first bit to count. */
  def begin(): Unit = run = 0

  /** The next bit is a stuff bit. */
  def awaits: Boolean = run == 5

  /** The level that it has. */
  def stuffBit: Boolean = !last

  /** A bit has passed, a stuff bit or another one. */
  def take(bit: Boolean): Unit = {
    run = if (run > 0 && bit == last) run + 1 else 1
    last = bit
  }
}
