package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.ethernet.{
  ArpResponder,
  EthernetReceiver,
  EthernetSender,
  ExpectedByte,
  NetworkSettings,
  UdpReceiver
}
import flyframe.mii.NibbleStream

/** The mailbox, as its host reads it: an order waits, as the answer that has brought it ([[AnswerLayout]]).
  */
class Mailbox extends Bundle {
  val waiting = Output(Bool())

  /** The host has taken it: the next one may come. */
  val take = Input(Bool())

  /** Byte of it, in the cycle in which it `looks`, and the byte a cycle later, only then; not in two cycles
    * one behind the other.
    */
  val looks       = Input(Bool())
  val readAddress = Input(UInt(6.W))
  val readData    = Output(UInt(8.W))
}

/** A master towards the plant network: it keeps events, reports, hears the server's answers, and answers ARP
  * requests.
  *
  * Reports, answers and ARP share what they need: the tag, the settings, and the numbers of reports and
  * events. Whoever has it keeps it until his work is done; reports come first. So nothing of what a report
  * says about events is changed by an answer while the report is made.
  */
class PlantSide extends Module {

  /** Once per nibble slot: `in` is to be taken. */
  val step = IO(Input(Bool()))
  val in   = IO(Input(new NibbleStream))
  val out  = IO(Output(new NibbleStream))

  /** Two copies of [[NetworkSettings]]: the byte comes a cycle after its address. */
  val settingAddress = IO(Output(Vec(2, UInt(NetworkSettings.AddressBits.W))))
  val setting        = IO(Input(Vec(2, UInt(8.W))))

  /** What the host has set: reports are made; times in ms and s. */
  val run           = IO(Input(Bool()))
  val repeatMs      = IO(Input(UInt(12.W)))
  val heartbeatMs   = IO(Input(UInt(12.W)))
  val serverTimeout = IO(Input(UInt(8.W)))

  /** One pulse every millisecond. */
  val millisecond = IO(Input(Bool()))

  /** What reports say. Time and lost frames must not change while `holds`, which never lasts a microsecond.
    */
  val master = IO(Input(new ReportedMaster))
  val holds  = IO(Output(Bool()))

  /** States of slaves: how many; byte of one, a cycle after its address (position, byte). */
  val known    = IO(Input(UInt(8.W)))
  val look     = IO(Output(UInt(10.W)))
  val lookData = IO(Input(UInt(8.W)))

  /** Events, see [[EventMemory]]; of the numbers the low halves. */
  val event          = IO(Vec(2, Flipped(Decoupled(UInt(16.W)))))
  val firstEvent     = IO(Output(UInt(16.W)))
  val nextEvent      = IO(Output(UInt(16.W)))
  val roomForRecords = IO(Output(Bool()))
  val roomForStates  = IO(Output(Bool()))
  val full           = IO(Output(Bool()))

  val mailbox = IO(new Mailbox)

  /** No right answer for too long. */
  val serverSilent = IO(Output(Bool()))

  /** Pulses: a datagram was refused; an order was dropped since another one waits. */
  val refused = IO(Output(Bool()))
  val dropped = IO(Output(Bool()))

  private val receiver = Module(new EthernetReceiver)
  private val expected = Module(new ExpectedByte)
  private val udp      = Module(new UdpReceiver)
  private val arp      = Module(new ArpResponder)
  private val link     = Module(new ServerLink)
  private val memory   = Module(new EventMemory)
  private val timer    = Module(new ReportTimer)
  private val reports  = Module(new ReportSender)
  private val tag      = Module(new AsconTag)
  private val store    = Module(new FrameStore)
  private val sender   = Module(new EthernetSender)

  // Frames that come and go.
  receiver.step := step
  receiver.in   := in
  expected.byte := receiver.byte
  expected.end  := receiver.end
  udp.byte      := receiver.byte
  udp.first     := receiver.first
  udp.end       := receiver.end
  udp.at        := expected.at
  udp.same      := expected.same
  udp.mine      := expected.mine
  arp.byte      := receiver.byte
  arp.first     := receiver.first
  arp.end       := receiver.end
  arp.at        := expected.at
  arp.same      := expected.same
  arp.mine      := expected.mine
  link.data     := udp.data
  link.offset   := udp.offset
  link.received := udp.received
  // Before it may report there is no answer, and perhaps no key.
  link.received.bits.good := udp.received.bits.good && run
  store.in <> reports.bytes
  store.note        := arp.note
  store.noteAddress := arp.noteAddress
  store.readAddress := arp.readAddress
  arp.asker         := store.readData
  reports.empty     := store.empty
  sender.step       := step
  out               := sender.out

  // Who has what is shared.
  private object Owner extends ChiselEnum { val none, report, link, arp = Value }
  private val owner = RegInit(Owner.none) // reset: nobody
  private val keeps = MuxLookup(owner, false.B)(
    Seq(Owner.report -> reports.wants, Owner.link -> link.wants, Owner.arp -> arp.wants)
  )
  when(!keeps) {
    owner := MuxCase(
      Owner.none,
      Seq(reports.wants -> Owner.report, link.wants -> Owner.link, arp.wants -> Owner.arp)
    )
  }
  when(owner =/= Owner.none && !keeps) { owner := Owner.none }
  private val isLink = owner === Owner.link
  // An answer to an ARP request is made when no report is leaving, and none begins meanwhile.
  private val answersArp = owner === Owner.arp && store.empty
  reports.granted := owner === Owner.report
  link.granted    := isLink
  arp.granted     := answersArp
  tag.granted     := owner === Owner.none

  settingAddress := VecInit(
    NetworkSettings.ofNetwork(expected.address),
    MuxLookup(owner, tag.settingAddress)(
      Seq(
        Owner.report -> reports.settingAddress,
        Owner.link   -> link.settingAddress,
        Owner.arp    -> NetworkSettings.ofNetwork(arp.settingAddress)
      )
    )
  )
  expected.setting := setting(0)
  reports.setting  := setting(1)
  link.setting     := setting(1)
  arp.setting      := setting(1)
  tag.setting      := setting(1)

  store.readsNote    := answersArp
  sender.bytes.valid := Mux(answersArp, arp.bytes.valid, store.out.valid)
  sender.bytes.bits  := Mux(answersArp, arp.bytes.bits, store.out.bits)
  store.out.ready    := sender.bytes.ready
  arp.bytes.ready    := sender.bytes.ready

  private val numbers = Cat(reports.counter, memory.first)
  private val number = VecInit((7 to 0 by -1).map(i => numbers(8 * i + 7, 8 * i)))(
    Mux(isLink, link.numberAddress, reports.numberAddress)
  )
  reports.number := number
  link.number    := number

  private val words = VecInit((3 to 0 by -1).map(i => master.time(16 * i + 15, 16 * i)))
  private val word  = words(Mux(memory.stamps, memory.timeAddress, reports.timeAddress))
  memory.now    := word
  reports.time  := word
  reports.again := memory.stamps || RegNext(mailbox.looks)

  tag.in.valid         := reports.tagged.valid || link.tagged.valid
  tag.in.bits          := Mux(isLink, link.tagged.bits, reports.tagged.bits)
  reports.tagged.ready := tag.in.ready
  link.tagged.ready    := tag.in.ready
  tag.end              := reports.tagEnd || link.tagEnd
  tag.tagReady         := reports.tagReady || link.tagReady
  reports.tag          := tag.tag
  link.tag             := tag.tag

  // Events and reports.
  memory.event <> event
  memory.remove    := link.remove
  memory.readEvent := reports.readEvent
  memory.readByte  := reports.readByte
  firstEvent       := memory.first
  nextEvent        := memory.next
  roomForRecords   := memory.roomForRecords
  roomForStates    := memory.roomForStates
  full             := memory.full
  holds            := memory.stamps || reports.holds

  timer.run         := run
  timer.millisecond := millisecond
  timer.kept        := memory.count =/= 0.U
  timer.repeatMs    := repeatMs
  timer.heartbeatMs := heartbeatMs
  timer.status      := master.status
  timer.begins      := reports.begins
  timer.answered    := link.alive
  // What an answer leaves is worth a report: the server has heard of it, but has not taken it.
  timer.news := memory.stored || link.newLife ||
    (link.remove.valid && link.remove.bits =/= 0.U && link.remove.bits =/= memory.count)

  reports.due       := timer.due
  reports.master    := master
  reports.known     := known
  reports.kept      := memory.count
  reports.eventData := memory.readData
  reports.server    := link.life
  reports.lookData  := lookData
  link.lifeAddress  := reports.serverAddress
  link.kept         := memory.count
  look              := reports.look

  // Whether the server is silent. Reset: it has been heard just now.
  private val part    = RegInit(0.U(10.W)) // ms of this second
  private val seconds = RegInit(0.U(8.W))
  private val isWhole = part === 999.U
  serverSilent := seconds >= serverTimeout
  when(millisecond) {
    part := Mux(isWhole, 0.U, part + 1.U)
    when(isWhole && !serverSilent) { seconds := seconds + 1.U }
  }
  when(link.alive) {
    part    := 0.U
    seconds := 0.U
  }

  mailbox.waiting  := link.waiting
  mailbox.readData := link.readData
  link.take        := mailbox.take
  link.looks       := mailbox.looks
  link.readAddress := mailbox.readAddress
  refused          := link.refused
  dropped          := link.dropped
}
