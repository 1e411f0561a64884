package flyframe.relay

/** Relay mode of a ring node behind its ports, fresh out of reset, as a tester meets it: the golden model or
  * the RTL.
  *
  * Time runs in core cycles. A level is true for recessive. Ports are 0 (port 1) and 1.
  */
trait RelayUnderTest {

  /** Core cycles since reset. */
  def cycle: Long

  /** The level that a port sends in the present cycle; it follows from the cycles before only. */
  def level(port: Int): Boolean

  /** A link is dominant for so long that its port has no signal (FR-63). */
  def isStuck(port: Int): Boolean

  /** Ends the present cycle.
    *
    * @param heard
    *   the level heard at each port
    * @param up
    *   the ports that are up
    */
  def step(heard: (Boolean, Boolean), up: (Boolean, Boolean)): Unit

  /** Lets a cycle pass, by [[step]], while the host accesses the RTL, which takes some. The tester sets it.
    */
  var passes: () => Unit = () => ()

  /** The host writes bytes, ascending from `address` (see [[flyframe.registers.RingRegisters]] and port F in
    * [[flyframe.registers.CanRegisters]]). They count from the present cycle on, or from the last one of the
    * access.
    */
  def write(address: Int, bytes: Seq[Int]): Unit

  /** The host reads `count` bytes. */
  def read(address: Int, count: Int): Seq[Int]
}
