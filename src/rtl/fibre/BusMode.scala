package flyframe.fibre

import chisel3._

/** What bus mode tells of itself. */
class BusReport extends Bundle {

  /** 1, 2 or 3. */
  val mode  = UInt(2.W)
  val guard = Bool()

  /** No port is up. */
  val alone = Bool()

  /** What the own controller sends is cut off; what a port hears counts as recessive. */
  val cutOff = Bool()
  val stuck  = Vec(2, Bool())

  /** The guard closes the ring; a latch makes the node guard: one cycle each. */
  val closes = Bool()
  val latch  = Bool()
}

/** What passes between two ports and the own controller (FR-15, FR-20 to FR-22, FR-37). All levels: 1 is
  * recessive.
  */
class BusMode extends Module {

  /** What the own controller sends, and what it hears. */
  val drive = IO(Input(Bool()))
  val bus   = IO(Output(Bool()))

  /** Of both ports: whether it is up, the level heard, and the level to be sent. */
  val up    = IO(Input(Vec(2, Bool())))
  val level = IO(Input(Vec(2, Bool())))
  val send  = IO(Output(Vec(2, Bool())))

  /** What the host has set: `forced` is a mode, or 0, and counts from the next cycle on. */
  val home    = IO(Input(Bool()))
  val forced  = IO(Input(UInt(2.W)))
  val address = IO(Input(UInt(7.W)))

  /** Relay mode is on, or there is no T to count by: nobody is guard (FB-15). */
  val rests = IO(Input(Bool()))

  val ticks = IO(Input(new BitTicks))

  /** A millisecond of the ports ends with this cycle. */
  val ms = IO(Input(Bool()))

  val report = IO(Output(new BusReport))

  private val ringGuard = Module(new Guard)

  // Reset: both ports are down, so that nothing is heard.
  private val isUp  = RegNext(up, VecInit(false.B, false.B))
  private val light = RegNext(level, VecInit(true.B, true.B)) // of a port that is down, too

  private val stuckPorts = Seq.fill(2)(Module(new StuckGuard(320 / 64)))
  private val stuckOwn   = Module(new StuckGuard(32 / 8))
  private def watch(stuck: StuckGuard, level: Bool, tick: Bool): Unit = {
    stuck.level     := level
    stuck.dominant  := tick
    stuck.recessive := ticks.four
  }
  for ((stuck, n) <- stuckPorts.zipWithIndex) watch(stuck, light(n), ticks.sixtyFour)
  watch(stuckOwn, drive, ticks.eight)

  // What does not hang on the own controller is decided a cycle before, as the way of a level through the
  // node has no time for it. Automatic: without any port up or with both, 1, or 2 for the guard; else that of
  // the port that is up. Reset: 1, and nothing is heard.
  private val isForced     = forced =/= 0.U
  private val becomesTwo   = Mux(isForced, forced === 2.U, Mux(up(0) === up(1), ringGuard.next, up(0)))
  private val becomesThree = Mux(isForced, forced === 3.U, !up(0) && up(1))
  private val comes        = (0 to 1).map(n => level(n) || !up(n) || stuckPorts(n).next)
  private val isTwo        = RegNext(becomesTwo, false.B)
  private val isThree      = RegNext(becomesThree, false.B)
  private val isOne        = !isTwo && !isThree
  private val heard2       = RegNext(comes(1), true.B)
  private val passes1      = RegNext(becomesThree || comes(0), true.B)
  private val passes2      = isTwo || heard2

  private val own = drive || stuckOwn.stuck
  bus     := own && passes1 && passes2
  send(0) := isThree || (own && passes2)
  send(1) := isTwo || (own && passes1)

  ringGuard.home    := home
  ringGuard.rests   := RegNext(isForced, false.B) || rests // reset: as the register
  ringGuard.address := address
  ringGuard.coming  := up
  ringGuard.up      := isUp
  ringGuard.bus     := bus
  ringGuard.heard2  := heard2
  ringGuard.ticks   := ticks
  ringGuard.ms      := ms

  report.mode   := (isThree || isTwo) ## (isThree || isOne)
  report.guard  := ringGuard.guard
  report.alone  := !isUp(0) && !isUp(1)
  report.cutOff := stuckOwn.stuck
  for (n <- 0 to 1) report.stuck(n) := stuckPorts(n).stuck
  report.closes := ringGuard.closes
  report.latch  := ringGuard.latch
}
