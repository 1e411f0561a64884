package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.memory.DualPortRam

/** Who reports, and how it is with the line. */
class ReporterStatus extends Bundle {
  val master   = UInt(16.W) // ID
  val boot     = UInt(16.W) // another one after each start: events count anew
  val selfTest = UInt(8.W)  // result of its host
  val present  = UInt(8.W)  // slaves that answer
  val known    = UInt(8.W)  // slaves listed
  val lost     = UInt(32.W) // frames sent in vain
  val time     = UInt(32.W) // of the master, in us
}

/** Keeps events until the server has acknowledged them, and makes the reports about them (REP-01 to REP-06,
  * docs/behaviour.md): when something happens, again and again until it is acknowledged, and as a heartbeat.
  *
  * @param depth
  *   events it keeps, a power of two
  */
class EventReporter(depth: Int) extends Module {
  import EventReporter._
  private val countBits = log2Ceil(depth + 1)

  val event  = IO(Flipped(Decoupled(new MasterEvent)))
  val status = IO(Input(new ReporterStatus))

  /** Less than half of the places are taken. */
  val room = IO(Output(Bool()))

  /** Numbers of the oldest event that is kept, and of the next one. */
  val firstEvent = IO(Output(UInt(32.W)))
  val nextEvent  = IO(Output(UInt(32.W)))

  /** One pulse every millisecond. After so many of them a report is repeated; it is made in any case. */
  val millisecond = IO(Input(Bool()))
  val repeatMs    = IO(Input(UInt(12.W)))
  val heartbeatMs = IO(Input(UInt(12.W)))

  /** The server has all events before this number. */
  val acknowledge = IO(Flipped(Valid(UInt(32.W))))

  /** To [[UdpSender]]. */
  val start       = IO(Output(Bool()))
  val length      = IO(Output(UInt(11.W)))
  val busy        = IO(Input(Bool()))
  val readAddress = IO(Input(UInt(11.W)))
  val readData    = IO(Output(UInt(8.W)))

  // The events, with the master's time; number `first` is the oldest.
  private class Kept extends Bundle {
    val event = new MasterEvent
    val time  = UInt(32.W)
  }
  private val ram   = DualPortRam(depth, (new Kept).getWidth)(clock)
  private val first = RegInit(0.U(32.W)) // reset: none yet
  private val count = RegInit(0.U(countBits.W))
  private val kept  = Wire(new Kept)
  kept.event          := event.bits
  kept.time           := status.time
  firstEvent          := first
  nextEvent           := first + count
  event.ready         := count =/= depth.U
  room                := count < (depth / 2).U
  ram.io.write        := event.fire
  ram.io.writeAddress := nextEvent(log2Ceil(depth) - 1, 0)
  ram.io.writeData    := kept.asUInt

  // Acknowledgements wait while a report is being sent.
  private val sending = RegInit(false.B) // reset: not
  private val asked   = RegInit(false.B) // an acknowledgement waits; reset: none
  private val upTo    = Reg(UInt(32.W))
  private val done    = upTo - first     // events it is about
  private val takes   = asked && !sending
  private val gone    = Mux(takes && done <= count, done(countBits - 1, 0), 0.U)
  when(acknowledge.valid) {
    asked := true.B
    upTo  := acknowledge.bits
  }.elsewhen(takes) { asked := false.B }
  first := first + gone
  count := count - gone + event.fire

  // When to report. Reset: a first heartbeat at once.
  private val fresh    = RegInit(false.B) // something to tell that has not been told
  private val waited   = RegInit("hfff".U(12.W))
  private val isTime   = waited >= Mux(count =/= 0.U, repeatMs, heartbeatMs)
  private val inReport = Reg(UInt(7.W))   // events in this report
  start := !sending && !busy && !takes && !event.fire && (fresh || isTime)
  when(millisecond && !waited.andR) { waited := waited + 1.U }
  private val number = Mux(count > Most.U, Most.U, count)
  length := HeaderBytes.U +& (number << 4)
  when(start) {
    sending := true.B
    fresh   := false.B
    waited  := 0.U
  }.elsewhen(sending && !busy && RegNext(busy, false.B)) { sending := false.B }
  when(event.fire || (gone =/= 0.U && count =/= gone)) { fresh := true.B }
  when(start) { inReport := number }

  // The report: header, then events; all numbers big endian.
  private val lostThen = RegEnable(status, start)
  private val header = Cat(
    Magic.U(16.W),
    Version.U(8.W),
    KindReport.U(8.W),
    lostThen.master,
    lostThen.boot,
    first,
    inReport.pad(8),
    lostThen.selfTest,
    lostThen.present,
    lostThen.known,
    lostThen.time,
    lostThen.lost
  )
  private val place   = readAddress - HeaderBytes.U
  private val inside  = RegNext(readAddress)
  private val bytes   = ram.io.readData.asTypeOf(new Kept)
  private val e       = bytes.event
  private val content = Cat(e.kind, e.position, e.node, e.sequence, e.state, e.epoch, e.time, bytes.time)
  private def byteOf(word: UInt, count: Int, at: UInt) =
    VecInit((0 until count).map(i => word(8 * (count - i) - 1, 8 * (count - i) - 8)))(at)
  ram.io.readAddress := (first + (place >> 4))(log2Ceil(depth) - 1, 0)
  readData := Mux(
    inside < HeaderBytes.U,
    byteOf(header, HeaderBytes, inside(4, 0)),
    byteOf(content, EventBytes, (inside - HeaderBytes.U)(3, 0))
  )
}

object EventReporter {

  /** The first bytes of every datagram between master and server, and what follows. */
  val Magic           = 0x4641
  val Version         = 1
  val KindReport      = 1
  val KindAcknowledge = 2

  val HeaderBytes = 24
  val EventBytes  = 16

  /** Events of one report. */
  val Most = 64
}
