package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.can.{CanOrder, RelaySide, SlotOrder}
import flyframe.params.CanParams
import flyframe.ram.DualPortRam

/** A node in relay mode without what receives: passing on, own frames, slots. */
class OwnNode(p: CanParams) extends Module {
  private val slotBits = log2Ceil(p.slots)

  val bitCycles = IO(Input(UInt(8.W)))
  val setting   = IO(Input(new OwnSetting))
  val restart   = IO(Input(Bool()))
  val unit      = IO(Input(Bool()))
  val heard     = IO(Input(Vec(2, Bool())))
  val up        = IO(Input(Vec(2, Bool())))
  val level     = IO(Output(Vec(2, Bool())))
  val received  = IO(Output(Vec(2, Bool())))
  val home      = IO(Input(Vec(2, Valid(new HomeFrame))))
  val counts    = IO(Output(new OwnCounts))
  val conflict  = IO(Output(Bool()))
  val offer     = IO(Output(Vec(2, Valid(UInt(32.W)))))
  val decides   = IO(Output(Vec(2, Bool())))

  /** The host: a word of a slot is written, a slot requested, slots are given up. */
  val write    = IO(Input(Valid(UInt((slotBits + 2).W))))
  val word     = IO(Input(UInt(32.W)))
  val append   = IO(Input(Valid(UInt(slotBits.W))))
  val appended = IO(Output(Bool()))
  val aborts   = IO(Input(UInt(p.slots.W)))
  val maps     = IO(Output(Vec(3, UInt(p.slots.W)))) // pending, sent, failed
  val begun    = IO(Output(UInt(p.slots.W)))

  private val passing = Module(new PassingOn(Schedule(p)))
  private val list    = Module(new SlotList(p, Schedule(p)))
  private val own     = Module(new OwnFrames(p, Schedule(p)))
  private val bytes   = Module(new OwnBytes(slotBits))
  private val slots   = SyncReadMem(4 * p.slots, UInt(32.W))
  private val ram     = DualPortRam(SlotOrder.words(p), RelaySide.listBits(p))(clock)
  when(write.valid) { slots.write(write.bits, word) }

  private val on      = RegNext(setting.on, false.B)
  private val pending = RegInit(0.U(p.slots.W))
  private val sent    = RegInit(0.U(p.slots.W))
  private val failed  = RegInit(0.U(p.slots.W))
  private val gone    = Mux(own.holds, 0.U, aborts & pending & ~own.begun)
  private val done    = Mux(own.ends.valid, UIntToOH(own.ends.bits, p.slots), 0.U)
  private val fresh   = Mux(list.appended, UIntToOH(append.bits, p.slots), 0.U)
  pending := (pending & ~gone & ~done) | fresh
  sent    := (sent & ~fresh) | Mux(own.sent, done, 0.U)
  failed  := (failed & ~fresh) | gone | Mux(own.sent, 0.U, done)
  maps    := VecInit(pending, sent, failed)
  begun   := own.begun

  passing.bitCycles  := bitCycles
  passing.on         := on
  passing.address    := setting.address
  passing.heard      := heard
  passing.up         := up
  passing.offer      := own.offer
  passing.order      := own.order
  passing.fetched    := bytes.fetched
  passing.read.valid := false.B
  passing.read.bits  := 0.U
  passing.from       := 0.U
  level              := passing.level
  received           := passing.received

  ram.serves(list.ram)
  list.on     := on
  list.walk   := own.walk
  list.keeps  := own.keeps
  list.append := append
  list.ready  := !bytes.load.valid
  list.look   := own.look
  appended    := list.appended

  private val data = slots.read(Mux(bytes.load.valid, bytes.load.bits, list.read.bits ## 0.U(2.W)))
  list.key      := CanOrder(data)
  bytes.data    := data
  bytes.address := setting.address
  bytes.leaves  := own.leaves
  bytes.fetch   := passing.fetch

  own.setting    := setting
  own.setting.on := on
  own.onNext     := setting.on
  own.restart    := restart
  own.unit       := unit
  own.tick       := passing.tick
  own.isUp       := passing.isUp
  own.received   := passing.received
  own.home       := home
  own.pending    := pending
  own.abort      := aborts
  own.entry      := list.entry
  own.coming     := list.coming
  own.nears      := list.next
  own.looked     := list.looked
  own.begins     := passing.begins
  own.sending    := passing.sending
  counts         := own.counts
  conflict       := own.conflict
  for (q <- 0 to 1) {
    offer(q).valid := own.offer(q)
    offer(q).bits  := RegNext(own.order)
  }
  decides := passing.decides
}
