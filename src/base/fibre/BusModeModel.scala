package flyframe.fibre

/** Bus mode of a node: what passes between its two ports and its own controller, and where the ring is open
  * (FR-15, FR-20 to FR-22, FR-30 to FR-37, FB-05, FB-06, FB-08, FB-09, FB-14, FB-15, FB-17). A level is true
  * for recessive.
  */
class BusModeModel {
  private var up1       = false         // as the node has taken it up
  private var up2       = false
  private var was2      = false         // port 2 has been up
  private var guard     = false
  private var forced    = 0
  private var toForce   = 0             // from the next cycle on
  private var r1        = true
  private var r2        = true
  private var light1    = true          // of a port that is down, too
  private var light2    = true
  private val clock     = new BitClockModel
  private val stuck1    = new StuckModel(320 / 64, 64)
  private val stuck2    = new StuckModel(320 / 64, 64)
  private val cut       = new StuckModel(32 / 8, 8)
  private val held      = new HoldModel // what a guard looks for
  private var isWaiting = false
  private var waited    = 0             // T
  private var hasWaited = false         // for long enough, a cycle before
  private var latch     = 0             // T of dominance in mode 1
  private var settling  = 0             // milliseconds until a guard that has come up watches port 2
  private var isTimed   = false         // there is a T
  private var wasHome   = false         // `home` could act in the cycle before

  /** Times that the guard closed the ring, and that a latch made the node guard; 8 bits, stop at 255. */
  var closings: Int = 0
  var latches: Int  = 0

  def isGuard: Boolean            = guard
  def isAlone: Boolean            = !up1 && !up2
  def isCut: Boolean              = cut.isStuck
  def isStuck(port: Int): Boolean = (if (port == 0) stuck1 else stuck2).isStuck

  /** The host forces a mode, from the cycle behind the next one on; 0: none. */
  def force(mode: Int): Unit = toForce = mode

  /** T, see [[FibreUnderTest.setBit]]. */
  def setBit(quanta: Int, prescaler: Int): Unit = clock.set(quanta, prescaler)

  /** 1, 2 or 3 (FR-20, FR-22). */
  def mode: Int =
    if (forced != 0) forced
    else if (up1 != up2) { if (up1) 2 else 3 }
    else if (guard) 2
    else 1

  private def heard1              = r1 || stuck1.isStuck
  private def heard2              = r2 || stuck2.isStuck
  private def own(drive: Boolean) = drive || cut.isStuck

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
    * @param port1
    *   which is up or not and hears a level
    * @param port2
    *   the other one
    * @param ms
    *   a millisecond of the ports ends with this cycle
    */
  def step(
      drive: Boolean,
      port1: OpticalPortModel,
      port2: OpticalPortModel,
      home: Boolean,
      address: Int,
      ms: Boolean
  ): Unit = {
    clock.step()
    val eighth  = clock.ends(1)
    val bit     = clock.ends(8)
    val now1    = port1.up
    val now2    = port2.up
    val heard   = bus(drive)
    val isFree  = forced == 0 && isTimed
    val inMode1 = isFree && up1 && up2 && !guard
    val begins  = ms && settling == 1 // to watch
    val isOver  = isWaiting && waited > 2 * (address % 8)
    val seeks   = if (settling > 0 || isWaiting && !hasWaited) !heard && !heard2 else heard != heard2
    held.step(guard && !begins && (hasWaited || !isOver) && seeks, eighth)
    val isFound = held.exceeds(if (hasWaited) 6 else 12)
    if (isFound) held.begin()
    val isLatched = latch > 40 + 2 * address
    val homeComes = home && isFree && !wasHome
    if (!inMode1 || heard) latch = 0 else if (bit) latch += 1

    if (!isFree || !now1 || !now2) open(false)
    else if (!up1 || !up2) open(home || !up2 && was2)
    else {
      if (guard && isWaiting) waits(home, mayClose = !homeComes, bit, isOver, isFound)
      else if (guard) startWaiting(isFound && settling == 0)
      else if (isLatched) {
        latches = 255 min latches + 1
        open(true)
      }
      guard ||= homeComes
    }
    wasHome = home && isFree
    hasWaited = isOver
    if (!up1 || !up2) settling = 2
    else if (isFound) settling = 0
    else if (ms && settling > 0) settling -= 1

    cut.step(drive, clock)
    stuck1.step(light1, clock)
    stuck2.step(light2, clock)
    light1 = port1.level
    light2 = port2.level
    r1 = light1 || !now1
    r2 = light2 || !now2
    was2 ||= now2
    forced = toForce
    isTimed = clock.isPossible
    up1 = now1
    up2 = now2
  }

  private def open(becomes: Boolean): Unit = {
    guard = becomes
    isWaiting = false
  }

  private def startWaiting(isSo: Boolean): Unit = {
    isWaiting = isSo
    waited = 0
  }

  private def waits(home: Boolean, mayClose: Boolean, bit: Boolean, isOver: Boolean, isFound: Boolean): Unit =
    if (mayClose && (if (hasWaited) isFound else home)) {
      closings = 255 min closings + 1
      open(false)
    } else if (isFound) isWaiting = false
    else if (bit && !isOver) waited += 1
}
