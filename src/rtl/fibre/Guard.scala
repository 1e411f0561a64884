package flyframe.fibre

import chisel3._

/** Whether a node is guard: the ring is open there (FR-30 to FR-36, FB-05, FB-06, FB-09, FB-14, FB-15,
  * FB-17).
  */
class Guard extends Module {

  /** What the host has set. */
  val home    = IO(Input(Bool()))
  val address = IO(Input(UInt(7.W)))

  /** Nobody is guard, closes or finds a latch. */
  val rests = IO(Input(Bool()))

  /** Both ports: up in this cycle, and as bus mode has taken it up. */
  val coming = IO(Input(Vec(2, Bool())))
  val up     = IO(Input(Vec(2, Bool())))

  /** What the own controller hears, and what port 2 does; 1 is recessive. */
  val bus    = IO(Input(Bool()))
  val heard2 = IO(Input(Bool()))

  val ticks = IO(Input(new BitTicks))

  /** A millisecond of the ports ends with this cycle. */
  val ms = IO(Input(Bool()))

  /** In this cycle, and in the next one. */
  val guard = IO(Output(Bool()))
  val next  = IO(Output(Bool()))

  /** It closes the ring; it finds a latch: one cycle each. */
  val closes = IO(Output(Bool()))
  val latch  = IO(Output(Bool()))

  // Reset: nobody is guard. A guard's ports are up.
  private val isGuard   = RegInit(false.B)
  private val isWaiting = RegInit(false.B) // to close, as guard, behind 1.5 T of difference
  private val wasUp2    = RegInit(false.B) // port 2 has been up
  when(coming(1)) { wasUp2 := true.B }

  private val automatic = !rests && coming(0) && coming(1) // what guards do, they do with both ports up
  private val comes     = !up(0) || !up(1)                 // then: the last one has just come up
  private val inMode1   = !rests && up(0) && up(1) && !isGuard

  // T: from -41 on of dominance in mode 1, and from -1 on while a guard waits.
  private val span                 = Reg(UInt(9.W)) // no reset: it begins anew as long as nothing is counted
  private val counts               = isWaiting || (inMode1 && !bus)
  private def passes(wanted: UInt) = !span(8) && span(7, 1) >= wanted
  private val isOver               = Mux(isGuard, passes(address(2, 0)), passes(address))

  // Milliseconds until a guard that has come up watches port 2: its neighbour may come up later (FB-14).
  private val settling   = Reg(UInt(2.W)) // no reset: set as long as a port is down
  private val isSettling = settling.orR
  private val settles    = ms && settling === 1.U

  // `home` that is set, or may act again, with both ports up (FB-05). Reset: as the register.
  private val actsHome  = home && !rests
  private val homeComes = actsHome && !RegNext(actsHome, false.B)

  private val hold      = Module(new HoldTimer)
  private val waitEnds  = isWaiting && isOver
  private val hasWaited = RegNext(waitEnds, false.B) // reset: as isWaiting
  private val seeks     = Mux(isSettling || (isWaiting && !hasWaited), !bus && !heard2, bus =/= heard2)
  hold.holds   := isGuard && !settles && (hasWaited || !waitEnds) && seeks
  hold.isShort := hasWaited
  hold.eighth  := ticks.eighth
  when(comes) { settling := 2.U }
    .elsewhen(hold.over) { settling := 0.U } // the neighbour is there
    .elsewhen(ms && isSettling) { settling := ShortCounter.down(settling) }

  // With the wait behind it, it closes if both sides still differ: another guard may have closed (FB-17).
  closes := automatic && isWaiting && Mux(hasWaited, hold.over, home) && !homeComes
  latch  := automatic && inMode1 && isOver
  when(!counts || closes) { span := Mux(isGuard && !closes, 511.U, (512 - 41).U) }
    .elsewhen(ticks.bit && !waitEnds) { span := ShortCounter.up(span) }

  private val atHome = home || (!up(1) && wasUp2)
  next      := automatic && Mux(comes, atHome, (isGuard && !closes) || latch || homeComes)
  isGuard   := next
  isWaiting := automatic && isGuard && !closes && (isWaiting ^ (hold.over && !isSettling))

  guard := isGuard
}
