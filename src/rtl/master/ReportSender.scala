package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.ethernet.{FrameByte, InternetSum, NetworkSettings}
import flyframe.lanes.Lanes
import flyframe.protocol.{EventLayout, Layout, MasterStatus, NonceLayout, ReportEndLayout, ReportLayout}
import flyframe.protocol.{ReportedSlaveLayout, ServerDatagram}
import flyframe.registers.{MasterRegisters, NetworkAddresses}

/** What a report says besides states of slaves and events. */
class ReportedMaster extends Bundle {
  val status  = UInt(MasterStatus.Width.W)
  val present = UInt(8.W)  // slaves that answer
  val cut     = UInt(8.W)  // first slave behind the cut
  val refused = UInt(8.W)  // datagrams refused
  val lost    = UInt(16.W) // frames sent in vain
  val time    = UInt(64.W) // of the master, in us
}

/** Makes reports (REP-01), as UDP datagrams over IPv4 and Ethernet (MST-10), a byte every third cycle. Each
  * byte is made once, but for the header of IP, which is summed before. The checksum of UDP is a constant:
  * the two bytes of balance at the end make the sum right.
  */
class ReportSender extends Module {
  import ReportSender._

  /** A report is due; it begins. It needs settings, tag and numbers from then on until it does not want them
    * any more; it begins when they are granted.
    */
  val due     = IO(Input(Bool()))
  val begins  = IO(Output(Bool()))
  val wants   = IO(Output(Bool()))
  val granted = IO(Input(Bool()))

  val master = IO(Input(new ReportedMaster))

  /** Time and lost frames must not change now. */
  val holds = IO(Output(Bool()))

  /** Slaves whose states are to be told, and events that are kept. */
  val known = IO(Input(UInt(8.W)))
  val kept  = IO(Input(UInt(EventMemory.CountBits.W)))

  /** Number of the last report. */
  val counter = IO(Output(UInt(32.W)))

  // Where bytes come from, each a cycle after its address; numbers in the same one.
  val settingAddress = IO(Output(UInt(NetworkSettings.AddressBits.W)))
  val setting        = IO(Input(UInt(8.W)))
  val numberAddress  = IO(Output(UInt(3.W)))  // counter, then number of the first event; first byte first
  val number         = IO(Input(UInt(8.W)))
  val timeAddress    = IO(Output(UInt(2.W)))  // time of the master, in words of 16 bits, the highest first
  val time           = IO(Input(UInt(16.W)))
  val serverAddress  = IO(Output(UInt(3.W)))  // life of the server
  val server         = IO(Input(UInt(8.W)))
  val look           = IO(Output(UInt(10.W))) // position of a slave, byte of its state
  val lookData       = IO(Input(UInt(8.W)))
  val readEvent      = IO(Output(UInt(5.W)))
  val readByte       = IO(Output(UInt(5.W)))
  val eventData      = IO(Input(UInt(8.W)))

  /** Somebody else has read the life of the server or the time: it must be read again. */
  val again = IO(Input(Bool()))

  /** To and from [[AsconTag]]. */
  val tagged   = IO(Decoupled(UInt(8.W)))
  val tagEnd   = IO(Output(Bool()))
  val tag      = IO(Input(Valid(UInt(8.W))))
  val tagReady = IO(Output(Bool()))

  /** To [[FrameStore]]; a report begins when that is empty. */
  val bytes = IO(Decoupled(new FrameByte))
  val empty = IO(Input(Bool()))

  private object Part extends ChiselEnum {
    val idle, nonce, sum, header, report, slaves, events, rest, tag, balance = Value
  }
  private val part                        = RegInit(Part.idle) // reset: nothing to report
  private val at                          = Reg(UInt(11.W))    // byte of this part
  private val age                         = Reg(UInt(2.W))     // cycles since it has changed, up to 2
  private val byte                        = Reg(UInt(8.W))
  private val sum                         = Reg(new InternetSum)
  private val slaves                      = Reg(UInt(8.W))
  private val events                      = Reg(UInt(6.W))
  private val sent                        = RegInit(0.U(32.W)) // reset: none yet
  private def is(parts: Part.Type*): Bool = parts.map(part === _).reduce(_ || _)
  private def isWord(offset: Int): Bool   = at(5, 1) === (offset / 2).U
  private def of(word: UInt, byte: UInt): UInt = // the first byte is the highest
    VecInit(Lanes.bytes(word, word.getWidth / 8).reverse)(byte)

  // It is never used again: the tags of two reports with one number would be worth nothing.
  private val isOver = sent.andR
  begins  := part === Part.idle && due && granted && empty && !isOver
  wants   := part =/= Part.idle || (due && empty && !isOver)
  counter := sent

  // Where the byte comes from: one of these, or it is 0.
  import ReportLayout._
  private val isHeader                           = is(Part.sum, Part.header)
  private val isReport                           = part === Part.report
  private val isNonce                            = part === Part.nonce
  private val group                              = at(5, 3) // eight bytes of the report
  private val isMac                              = at < MacEnd.U
  private val isAddress                          = at >= AddressStart.U && at < AddressEnd.U
  private val isCheck                            = isWord(24)
  private def inGroup(field: Layout.Field): Bool = isReport && group === (field.offset / 8).U
  private def isByte(offset: Int): Bool          = at(5, 0) === offset.U
  private val isLife                             = Mux(isNonce, !at(3), group === (Life.offset / 8).U)
  private val isId                               = group === 0.U && at(2, 1) === (Master.offset / 2).U
  private val isSelf                             = isByte(SelfTest.offset)
  private val bytes4                             = slaves +& (events << 2) + (events << 1)
  private val length = (bytes4 << 2) + Mux(at(5), (FixedBytes + 8).U, (FixedBytes + 28).U) // of UDP, of IP
  private val check  = ~Mux(at(0), sum.other, sum.next)
  private val counts =
    Cat(events.pad(8), slaves, master.present, 0.U(8.W), master.cut, master.refused, 0.U(16.W))
  private val constants = Seq(
    Magic.offset   -> (ServerDatagram.Magic >> 8),
    Magic.last     -> (ServerDatagram.Magic & 0xff),
    Version.offset -> ServerDatagram.Version,
    Kind.offset    -> ServerDatagram.KindReport
  ).map { case (n, b) => (isReport && isByte(n)) -> b.U(8.W) } ++
    // IPv4; not to be fragmented; 64 hops; UDP; checksum of UDP.
    Seq(
      12 -> 0x08,
      14 -> 0x45,
      20 -> 0x40,
      22 -> 0x40,
      23 -> 0x11,
      40 -> (Checksum >> 8),
      41 -> (Checksum & 0xff)
    ).map { case (n, b) =>
      (isHeader && isByte(n)) -> b.U(8.W)
    } :+ ((isNonce && isByte(NonceLayout.Origin.offset)) -> ServerDatagram.OfMaster.U(8.W))
  private val chosen = Mux1H(
    Seq(
      ((isHeader && (isMac || isAddress)) || (isNonce && !at(
        3
      )) || (isReport && (isLife || isId || isSelf)))   -> setting,
      ((isNonce && at(3) && at(2)) || inGroup(Counter)) -> number,
      ((isHeader && isCheck) || part === Part.balance)  -> check,
      (isHeader && (isWord(16) || isWord(38)))          -> Mux(at(0), length(7, 0), length(10, 8)),
      inGroup(Server)                                   -> server,
      inGroup(Time)                                     -> Mux(at(0), time(7, 0), time(15, 8)),
      inGroup(Status)        -> of(Cat(master.status.pad(32), master.lost.pad(32)), at(2, 0)),
      inGroup(Count)         -> of(counts, at(2, 0)),
      (part === Part.slaves) -> lookData,
      (part === Part.events) -> eventData,
      (part === Part.tag)    -> tag.bits
    ) ++ constants
  )
  holds := inGroup(Time) || (isReport && at(5, 2) === (Lost.offset / 4).U)

  // Addresses stand in the header as in the settings, in two pieces.
  settingAddress := Mux(
    isHeader,
    at(5, 0) + Mux(isMac, NetworkAddresses.First.U, (NetworkAddresses.First - AddressStart + MacEnd).U),
    Mux(
      isLife,
      MasterRegisters.MasterLife.U | at(2, 0),
      Mux(at(5), MasterRegisters.SelfTest.U, MasterRegisters.MasterId.U | !at(0))
    )
  )
  numberAddress := Cat(part === Part.report && at(2), at(1, 0))
  serverAddress := at(2, 0)
  timeAddress   := at(2, 1)
  look          := at(9, 0)
  readEvent     := at(9, 5)
  readByte      := at(4, 0)

  require(NonceLayout.Life.bytes == 8 && NonceLayout.Counter.offset == 12, "places in the nonce")
  when(part =/= Part.tag || tag.valid) { byte := chosen }

  // All that is sent behind the header of IP is summed on to the sum of that header, but for the balance. Two
  // bytes of nothing at the end of each sum fold its carry.
  private val isData   = is(Part.report, Part.slaves, Part.events, Part.rest, Part.tag)
  private val behindIp = at(5, 0) >= UdpStart.U
  private val folds    = (part === Part.sum && behindIp) || (part === Part.balance && !at(1))
  private val isSummed = isData || (part === Part.sum && !isCheck) ||
    (part === Part.header && behindIp && !isWord(40))

  // To whom the byte goes: all have to be ready.
  private val ready  = age === 2.U
  private val toWire = isData || part === Part.header || (part === Part.balance && at(1))
  private val toTag  = is(Part.nonce, Part.report, Part.slaves, Part.events)
  private val isEmpty =
    (part === Part.slaves && at(10, 2) === slaves) || (part === Part.events && at(10, 5) === events)
  private val fires = ready && !isEmpty && (!toWire || bytes.ready) && (!toTag || tagged.ready)
  bytes.valid     := ready && !isEmpty && toWire && (!toTag || tagged.ready)
  bytes.bits.data := byte
  bytes.bits.last := part === Part.balance && at(0)
  tagged.valid    := ready && !isEmpty && toTag && (!toWire || bytes.ready)
  tagged.bits     := byte
  tagEnd          := part === Part.events && isEmpty
  tagReady        := part === Part.tag && age === 0.U && !tag.valid

  private val lasts = Seq(
    Part.nonce   -> (NonceLayout.bytes - 1),
    Part.sum     -> (UdpStart + 1),
    Part.header  -> (HeaderBytes - 1),
    Part.report  -> (ReportLayout.bytes - 1),
    Part.rest    -> (ReportEndLayout.Rest.bytes - 1),
    Part.tag     -> (ReportEndLayout.Tag.bytes - 1),
    Part.balance -> 3
  )
  private val isLast = Mux1H(lasts.map { case (p, last) => (part === p) -> (at(5, 0) === last.U) })
  private val moves  = isEmpty || (fires && isLast)
  age := Mux(fires || part === Part.idle || isEmpty, 0.U, Mux(ready, age, age + 1.U))
  when(part === Part.report && again) { age := 0.U }
  when(part === Part.tag && !ready) { age := Mux(tag.valid, 2.U, 0.U) }
  when(fires) {
    // Events are 32 apart.
    val isEventEnd = part === Part.events && at(4, 0) === (EventLayout.bytes - 1).U
    at := at + Mux(isEventEnd, (32 - EventLayout.bytes + 1).U, 1.U)
    when(isSummed || folds) { sum := sum.plus(Mux(isSummed && !folds, byte, 0.U)) }
  }
  when(moves) {
    at := Mux(part === Part.nonce, IpStart.U, 0.U)
    part := MuxLookup(part, Part.idle)(
      Part.all.drop(1).zip(Part.all.drop(2) :+ Part.idle).map { case (here, next) => here -> next }
    )
  }
  when(part === Part.idle) {
    at     := 0.U
    sum    := InternetSum.of(0)
    slaves := known
    events := Mux(kept > ServerDatagram.Most.U, ServerDatagram.Most.U, kept)
  }
  when(begins) {
    part := Part.nonce
    sent := sent + 1.U
  }
  require(ReportedSlaveLayout.bytes == 4, "bytes of a slave's state")
}

object ReportSender {

  /** Where things begin in a frame. */
  private val IpStart      = 14
  private val MacEnd       = 12
  private val AddressStart = 26
  private val AddressEnd   = 38
  private val UdpStart     = 34
  private val HeaderBytes  = 42

  /** Bytes of a report besides the states of slaves and the events, each of which is a multiple of four. */
  private val FixedBytes = ReportLayout.bytes + ReportEndLayout.bytes

  /** The checksum of UDP. It makes up for what the header of IP has beside protocol, length of UDP and
    * addresses, since the sum goes on from that header: words of version, fragments, hops, and 20 bytes more.
    */
  private val Checksum = 0x4500 + 0x4000 + 0x4000 + 20
}
