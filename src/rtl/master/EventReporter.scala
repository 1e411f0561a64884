package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.memory.DualPortRam
import flyframe.protocol.ServerDatagram._
import flyframe.protocol.{EventLayout, MasterEvent, ReportLayout}

/** What a report says besides events: which master it is from, and how its line is. */
class ReporterStatus extends Bundle {
  val master   = UInt(16.W) // ID
  val boot     = UInt(16.W) // number of its start; events are numbered anew after each
  val selfTest = UInt(8.W)  // result of its host
  val present  = UInt(8.W)  // slaves that answer
  val known    = UInt(8.W)  // slaves listed
  val lost     = UInt(32.W) // frames sent in vain
  val time     = UInt(32.W) // of the master, in us
}

/** Keeps events until the server has acknowledged them, and makes the reports about them (REP-01 to REP-06,
  * docs/rules/alarm.md): when something happens, again and again until it is acknowledged, and as a
  * heartbeat.
  *
  * A report is sent as it stands in the memory of the events: its header is put before the oldest one.
  *
  * @param depth
  *   places for events, a power of two; two of them are for the header
  */
class EventReporter(depth: Int) extends Module {
  import EventReporter._
  private val placeBits = log2Ceil(depth)

  /** Events, see [[MasterEvent]]; those of the first source come first. */
  val event  = IO(Vec(2, Flipped(Decoupled(UInt(16.W)))))
  val status = IO(Input(new ReporterStatus))

  /** Less than half of the places are taken: records of slaves are welcome. */
  val room = IO(Output(Bool()))

  /** The number of the oldest event that is kept, and the number that the next event gets or the one on its
    * way has. Low bits only.
    */
  val firstEvent = IO(Output(UInt(NumberBits.W)))
  val nextEvent  = IO(Output(UInt(NumberBits.W)))

  /** One pulse every millisecond; after how many of them a report is repeated that was not acknowledged, and
    * after how many one is made without events.
    */
  val millisecond = IO(Input(Bool()))
  val repeatMs    = IO(Input(UInt(12.W)))
  val heartbeatMs = IO(Input(UInt(12.W)))

  /** The server has stored all events before this number. */
  val acknowledge = IO(Flipped(Valid(UInt(32.W))))

  /** To [[UdpSender]]: the byte comes a cycle after its address. */
  val start       = IO(Output(Bool()))
  val length      = IO(Output(UInt(11.W)))
  val busy        = IO(Input(Bool()))
  val readAddress = IO(Input(UInt(11.W)))
  val readData    = IO(Output(UInt(8.W)))

  private object State extends ChiselEnum { val idle, event, stamp, header = Value }
  private val state    = RegInit(State.idle)       // reset: nothing to write
  private val word     = Reg(UInt(4.W))            // of the event or the header that is being written
  private val first    = RegInit(0.U(32.W))        // reset: none yet
  private val count    = RegInit(0.U(placeBits.W)) // events kept
  private val before   = Reg(UInt(placeBits.W))    // where the header is: two places before the first event
  private val inReport = Reg(UInt(7.W))            // events in it
  private val chosen   = Reg(Bool())               // the event comes from the second source
  private val low      = Reg(UInt(16.W))           // of a number whose high half has been written
  firstEvent := first
  nextEvent  := first + count
  room       := count < (depth / 2).U
  for ((source, i) <- event.zipWithIndex) source.ready := state === State.event && chosen === i.U
  private val fires = VecInit(event.map(_.fire)).asUInt.orR

  // Acknowledgements of events that exist.
  private val done  = acknowledge.bits - first
  private val takes = acknowledge.valid && done <= count && done =/= 0.U
  private val kept  = WireDefault(false.B) // one more event
  when(takes) { first := acknowledge.bits }
  count := count - Mux(takes, done, 0.U)(placeBits - 1, 0) + kept

  // When to report. Reset: a first heartbeat at once.
  private val sending = RegInit(false.B) // reset: not
  private val fresh   = RegInit(false.B) // something to tell that has not been told
  private val waited  = RegInit("hfff".U(12.W))
  private val isTime  = waited >= Mux(count =/= 0.U, repeatMs, heartbeatMs)
  // What is being sent must stay, its header too.
  private val last = Mux(sending, before, first(placeBits - 1, 0) - HeaderPlaces.U)
  private val full = nextEvent(placeBits - 1, 0) === last
  when(millisecond && !waited.andR) { waited := waited + 1.U }
  start  := false.B
  length := ReportLayout.bytes.U +& (inReport << log2Ceil(EventLayout.bytes))

  // The memory, in words; numbers are big endian.
  private val ram     = DualPortRam(depth * EventWords, 16)(clock)
  private val header  = Cat(before, (HeaderPlaces * EventWords - HeaderWords).U(3.W)) // its first word
  private val content = WireDefault(low)
  private val second  = RegNext(readAddress(0))
  ram.io.write := state === State.header || state === State.stamp || fires
  ram.io.writeAddress := Mux(
    state === State.header,
    header + word,
    Cat(nextEvent(placeBits - 1, 0), word(2, 0))
  )
  ram.io.writeData   := content
  ram.io.readAddress := header + (readAddress >> 1)
  readData           := Mux(second, ram.io.readData(7, 0), ram.io.readData(15, 8))

  switch(state) {
    is(State.idle) {
      word   := 0.U
      chosen := !event(0).valid
      when((event(0).valid || event(1).valid) && !full) {
        state := State.event
      }.elsewhen(!sending && !busy && !takes && (fresh || isTime)) {
        state    := State.header
        before   := first - HeaderPlaces.U
        inReport := Mux(count > Most.U, Most.U, count)
      }
    }
    is(State.event) {
      content := Mux(chosen, event(1).bits, event(0).bits)
      when(fires) {
        word := word + 1.U
        when(word === (MasterEvent.Words - 1).U) { state := State.stamp }
      }
    }
    is(State.stamp) { // with the time of the master
      when(!word(0)) {
        content := status.time(31, 16)
        low     := status.time(15, 0)
      }.otherwise {
        kept  := true.B
        fresh := true.B
        state := State.idle
      }
      word := word + 1.U
    }
    is(State.header) {
      val words = Seq(
        ReportLayout.Magic.word        -> Magic.U,
        ReportLayout.Version.word      -> Cat(Version.U(8.W), KindReport.U(8.W)), // and kind
        ReportLayout.Master.word       -> status.master,
        ReportLayout.Boot.word         -> status.boot,
        ReportLayout.Number.word       -> first(31, 16),
        (ReportLayout.Number.word + 1) -> first(15, 0),
        ReportLayout.Count.word        -> Cat(inReport.pad(8), status.selfTest),  // and self-test
        ReportLayout.Present.word      -> Cat(status.present, status.known),      // and known
        ReportLayout.Time.word         -> status.time(31, 16),
        (ReportLayout.Time.word + 1)   -> low,
        ReportLayout.Lost.word         -> status.lost(31, 16),
        (ReportLayout.Lost.word + 1)   -> low
      )
      content := Mux1H(words.map { case (place, content) => (word === place.U) -> content.pad(16) })
      word    := word + 1.U
      when(word === ReportLayout.Time.word.U) { low := status.time(15, 0) }
      when(word === ReportLayout.Lost.word.U) { low := status.lost(15, 0) }
      when(takes || busy) { // it is not true any more, or not wanted
        state := State.idle
        when(busy) { fresh := true.B }
      }.elsewhen(word === (HeaderWords - 1).U) {
        start   := true.B
        sending := true.B
        fresh   := false.B
        waited  := 0.U
        state   := State.idle
      }
    }
  }
  when(takes && done =/= count) { fresh := true.B }
  when(sending && !busy && RegNext(busy, false.B)) { sending := false.B }
}

object EventReporter {

  /** Bits of an event's number that the line remembers: a slave that was away for longer is confirmed late.
    */
  val NumberBits = 24

  private val HeaderWords  = ReportLayout.bytes / 2
  private val EventWords   = EventLayout.bytes / 2
  private val HeaderPlaces = 2
}
