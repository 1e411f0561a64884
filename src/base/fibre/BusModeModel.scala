package flyframe.fibre

/** Bus mode of a node: what passes between its two ports and its own controller, and where the ring is open
  * (FR-15, FR-20 to FR-22, FR-30 to FR-37, FB-05, FB-06, FB-08, FB-09, FB-11). A level is true for recessive.
  */
class BusModeModel {
  import BusModeModel._
  private var up1       = false // as the node has taken it up
  private var up2       = false
  private var was2      = false // port 2 has been up
  private var guard     = false
  private var forced    = 0
  private var r1        = true
  private var r2        = true
  private val stuck1    = new StuckModel(320)
  private val stuck2    = new StuckModel(320)
  private val cut       = new StuckModel(32)
  private val differ    = new HoldModel(12)
  private val together  = new HoldModel(12)
  private var isWaiting = false
  private var waits     = 0     // eighths left
  private var mark      = 0     // eighths left of the dominance that tells of closing
  private var latch     = 0     // eighths of dominance in mode 1
  private var part      = 0     // of an eighth, in eighths of a core cycle

  /** Times that the guard closed the ring, and that a latch made the node guard; 8 bits, stop at 255. */
  var closings: Int = 0
  var latches: Int  = 0

  def isGuard: Boolean            = guard
  def isAlone: Boolean            = !up1 && !up2
  def isCut: Boolean              = cut.isStuck
  def isStuck(port: Int): Boolean = (if (port == 0) stuck1 else stuck2).isStuck

  /** 1, 2 or 3 (FR-20, FR-22). */
  def mode: Int =
    if (forced != 0) forced
    else if (up1 == up2) { if (guard) 2 else 1 }
    else if (up1) 2
    else 3

  private def heard1              = r1 || stuck1.isStuck
  private def heard2              = r2 || stuck2.isStuck
  private def own(drive: Boolean) = (drive || cut.isStuck) && mark == 0

  /** What the own controller hears when it sends `drive`. */
  def bus(drive: Boolean): Boolean = mode match {
    case 1 => own(drive) && heard1 && heard2
    case 2 => own(drive) && heard1
    case _ => own(drive) && heard2
  }

  /** What is sent at each port. */
  def send1(drive: Boolean): Boolean = mode match {
    case 1 => own(drive) && heard2
    case 2 => own(drive)
    case _ => true
  }
  def send2(drive: Boolean): Boolean = mode match {
    case 1 => own(drive) && heard1
    case 2 => true
    case _ => own(drive)
  }

  /** Ends a core cycle.
    *
    * @param ports
    *   up and level heard of both
    * @param bitCycles
    *   T in core cycles
    */
  def step(
      drive: Boolean,
      ports: Seq[OpticalPortModel],
      home: Boolean,
      force: Int,
      address: Int,
      bitCycles: Int
  ): Unit = {
    part += 8
    val eighth = part >= bitCycles
    if (eighth) part -= bitCycles
    if (eighth && mark > 0) mark -= 1
    val (now1, now2) = (ports(0).up, ports(1).up)
    val heard        = bus(drive)
    differ.step(guard && heard != heard2, eighth)
    together.step(guard && !heard && !heard2, eighth)
    val inMode1 = force == 0 && up1 && up2 && !guard
    if (!inMode1 || heard) latch = 0 else if (eighth) latch += 1

    if (force != 0 || !now1 || !now2) open(false)
    else if (!up1 || !up2) open(home || !up2 && was2)
    else if (guard) closing(home, address, eighth)
    else if (latch > 8 * 40 + 16 * address) {
      latches = 255 min latches + 1
      open(true)
    }

    cut.step(drive, eighth)
    stuck1.step(r1, eighth)
    stuck2.step(r2, eighth)
    r1 = ports(0).level || !now1
    r2 = ports(1).level || !now2
    was2 ||= now2
    up1 = now1
    up2 = now2
    forced = force
  }

  private def open(becomes: Boolean): Unit = {
    guard = becomes
    isWaiting = false
  }

  private def closing(home: Boolean, address: Int, eighth: Boolean): Unit =
    if (!isWaiting) {
      if (differ.isOver) {
        isWaiting = true
        waits = if (home) 0 else 16 * (address % 8)
      }
    } else if (together.isOver) isWaiting = false
    else if (waits == 0) {
      closings = 255 min closings + 1
      open(false)
      mark = Mark
    } else if (eighth) waits -= 1
}

object BusModeModel {

  /** Eighths of T of the dominance behind a closing (FB-11). */
  private val Mark = 8 * 7
}
