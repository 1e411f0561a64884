package flyframe.fibre

/** Ports and bus mode of a ring node, fresh out of reset, as a tester meets them: the golden model or the
  * RTL.
  *
  * Time runs in core cycles. A level is true for recessive, light is true for on. Ports are 0 (port 1) and 1.
  */
trait FibreUnderTest {

  /** Core cycles since reset. */
  def cycle: Long

  /** The light that a port sends in the present cycle; it follows from the cycles before only. */
  def light(port: Int): Boolean

  /** What the own controller hears in the present cycle, in which it sends `drive`. */
  def bus(drive: Boolean): Boolean

  /** An event is pending that the mask lets pass. */
  def interrupt: Boolean

  /** Ends the present cycle.
    *
    * @param light1
    *   samples of optical input 1 in this cycle, the first one in bit 0
    * @param light2
    *   those of optical input 2
    * @param optical
    *   the inputs `optical_signal` of the two ports, in bits 0 and 1
    */
  def step(drive: Boolean, light1: Int, light2: Int, optical: Int = 3): Unit

  /** T, the bit of port F: time quanta, 8 to 127, each of `prescaler` core cycles, 1 to 2048 (FB-08); without
    * quanta the setting is impossible, and there is none.
    */
  def setBit(quanta: Int, prescaler: Int = 1): Unit

  /** The host writes a byte (see [[flyframe.registers.RingRegisters]]); it counts in the next cycle. */
  def write(address: Int, byte: Int): Unit

  /** The host reads a byte. */
  def read(address: Int): Int
}
