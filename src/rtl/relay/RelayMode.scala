package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.can.{CanOrder, RelaySide}
import flyframe.fibre.RingLinks
import flyframe.memory.HostPort
import flyframe.params.CanParams

/** Relay mode of a ring node (FR-40 to FR-63) between its ports, its CAN port on the fibre, and the host. It
  * only connects.
  */
class RelayMode(p: CanParams) extends Module {
  private val slotBits = log2Ceil(p.slots)

  val port  = IO(new RelaySide(p))
  val links = IO(new RingLinks)
  val host  = IO(new HostPort(4))
  val irq   = IO(Output(Bool()))

  /** What is counted, by [[RelayCounter]], each a pulse. */
  val counts = IO(Output(Vec(RelayCounter.Count, Bool())))

  /** A microsecond ends with this cycle; how many had ended before it. */
  val us   = IO(Input(Bool()))
  val time = IO(Input(UInt(16.W)))

  private val schedule  = Schedule(p)
  private val passing   = Module(new PassingOn(schedule))
  private val list      = Module(new SlotList(p, schedule))
  private val own       = Module(new OwnFrames(p, schedule))
  private val bytes     = Module(new OwnBytes(slotBits))
  private val receiving = Module(new Receiving(p))
  private val sources   = Module(new Sources)
  private val front     = Module(new RelayHost(LinkTiming.least(p.coreClockMhz)))
  private val setting   = front.setting

  // ---- time: units of 10 us, and of 640 us (RB-22, RB-23) ----

  private val tens  = RegInit(0.U(4.W))       // reset: time begins
  private val units = RegInit(0.U(6.W))
  private val isTen = us && tens === 9.U
  private val unit  = RegNext(isTen, false.B) // its first cycle
  when(us) { tens := Mux(isTen, 0.U, tens + 1.U) }
  when(unit) { units := units + 1.U }
  private val tickTime = RegEnable(time, passing.tick)

  // ---- links ----

  links.on          := setting.on
  links.send        := passing.level
  links.stuck       := passing.stuck
  passing.bitCycles := front.bitCycles
  passing.on        := setting.on
  passing.address   := links.address
  passing.heard     := links.level
  passing.up        := links.up
  passing.offer     := own.offer
  passing.order     := own.order
  passing.fetched   := bytes.fetched

  // ---- what comes ----

  receiving.on         := setting.on
  receiving.address    := links.address
  receiving.time       := tickTime
  receiving.starts     := passing.starts
  receiving.identified := passing.identified
  receiving.received   := passing.received
  receiving.granted    := passing.granted
  receiving.data       := passing.data
  passing.read         := receiving.read
  passing.from         := receiving.from

  sources.on      := setting.on
  sources.confirm := setting.confirm
  sources.unit    := unit && units.andR
  sources.frame   := receiving.frame
  sources.asks    := front.asks
  front.told      := sources.told
  receiving.done  := sources.done
  receiving.takes := sources.takes

  for (to <- receiving.busy; from <- port.busy) to := from
  port.start        := receiving.search
  port.identifier   := receiving.identifier
  receiving.found   := port.done
  receiving.matches := port.matches
  receiving.entry   := port.entry
  port.store        := receiving.store
  port.word         := receiving.stored
  port.accept       := receiving.accept
  port.second       := receiving.second

  // ---- own frames ----

  list.on := setting.on
  port.list <> list.ram
  list.walk   := own.walk
  list.keeps  := own.keeps
  list.look   := own.look
  list.append := port.append
  list.ready  := port.orderReady
  list.key    := CanOrder(port.data)

  bytes.address := links.address
  bytes.leaves  := own.leaves
  bytes.fetch   := passing.fetch
  bytes.data    := port.data

  own.setting  := setting
  own.onNext   := front.onNext
  own.restart  := front.restart
  own.unit     := unit
  own.tick     := passing.tick
  own.isUp     := passing.isUp
  own.received := passing.received
  own.home     := receiving.home
  own.pending  := port.pending
  own.abort    := port.abort
  own.entry    := list.entry
  own.coming   := list.coming
  own.nears    := list.next
  own.looked   := list.looked
  own.begins   := passing.begins
  own.sending  := passing.sending

  // A switch of the mode lets all slots fail (RB-25). Reset: bus mode.
  port.on          := setting.on
  port.appended    := list.appended
  port.slots.begun := own.begun
  port.slots.holds := own.holds
  port.slots.ends  := own.ends
  port.slots.sent  := own.sent
  port.slots.drops := front.switches
  port.load        := bytes.load
  port.order       := list.read

  // The stamp of a frame is that of the start of its last copy (RB-17), which leaves with the bit behind the
  // decision. Reset: there is none.
  private val begun  = RegInit(VecInit(false.B, false.B))
  private val stamps = RegInit(VecInit(false.B, false.B))
  private val stamp  = Mux(stamps(0), own.leaves(0), own.leaves(1))
  private val leaves = RegNext(passing.tick, false.B) // the time of that bit is there
  for (q <- 0 to 1) {
    when(port.stamped && port.stamp.valid && (q == 0).B === stamps(0)) { stamps(q) := false.B }
    when(leaves && begun(q)) {
      begun(q)  := false.B
      stamps(q) := !own.leaves(q).isLife
    }
    when(RegNext(passing.begins(q), false.B)) { begun(q) := true.B }
    when(!setting.on) {
      begun(q)  := false.B
      stamps(q) := false.B
    }
  }
  port.stamp.valid := stamps.asUInt.orR
  port.stamp.bits  := stamp.slot
  port.time        := tickTime

  // ---- the host ----

  front.host <> host
  front.oneShot  := port.oneShot
  front.conflict := own.conflict
  front.address  := links.address
  irq            := front.irq

  private val c = passing.counts
  counts(RelayCounter.BadHeader)     := c.badHeader(0)
  counts(RelayCounter.BadHeader + 1) := c.badHeader(1)
  counts(RelayCounter.BadFrame)      := c.badFrame(0)
  counts(RelayCounter.BadFrame + 1)  := c.badFrame(1)
  counts(RelayCounter.Stray)         := c.stray
  counts(RelayCounter.Doubles)       := sources.double
  counts(RelayCounter.Repeated)      := own.counts.repeated
  counts(RelayCounter.Failed)        := own.counts.failed
  counts(RelayCounter.Aborted)       := c.aborted
  counts(RelayCounter.Wrapped)       := c.wrapped
  counts(RelayCounter.Passed)        := c.passed(0)
  counts(RelayCounter.Passed + 1)    := c.passed(1)
  counts(RelayCounter.OwnSent)       := own.counts.sent
  counts(RelayCounter.Confirmed)     := own.counts.confirmed
}
