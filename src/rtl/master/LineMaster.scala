package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.mii.NibbleStream
import flyframe.protocol.{EventKind, SlaveStateLayout, SlaveStatus}

/** Runs a line of alarm slaves, or a ring of them (LM-01 to LM-13, docs/rules/alarm.md). In each cycle a
  * frame asks all slaves together how they are, reads the states of some, confirms what the server has, and
  * takes the records that slaves have appended. State and history are apart: what sounds follows from what
  * comes back in every cycle, and neither reporter nor server can keep it from coming.
  *
  * @param maxSlaves
  *   slaves that the table has places for, a power of two from 2 to 128
  * @param maxSubTelegrams
  *   datagrams of a frame, at least [[flyframe.params.EscParams.LeastOfMaster]]; above 16 they are 16
  * @param linePorts
  *   1, or 2: the ends of a ring
  */
class LineMaster(maxSlaves: Int, maxSubTelegrams: Int, linePorts: Int) extends Module {
  import LineMaster._
  private val bits = log2Ceil(maxSlaves)

  /** Once per nibble slot. */
  val step   = IO(Input(Bool()))
  val in     = IO(Input(Vec(linePorts, new NibbleStream)))
  val out    = IO(Output(Vec(linePorts, new NibbleStream)))
  val source = IO(Input(UInt(48.W))) // MAC address, first byte in the low bits

  /** The host has set everything up: the line is to run. */
  val run = IO(Input(Bool()))

  /** Length of a cycle, time to wait for an answer, in slots of 40 ns; how often a frame is sent again. */
  val cycle   = IO(Input(UInt(20.W)))
  val timeout = IO(Input(UInt(16.W)))
  val retries = IO(Input(UInt(4.W)))

  /** The life of this master; the expected slaves are set; the low half of the number of the first event that
    * the server does not have.
    */
  val life      = IO(Input(UInt(16.W)))
  val listed    = IO(Input(Bool()))
  val confirmed = IO(Input(UInt(16.W)))

  /** A datagram of the host is taken and sent in the next cycle, in a ring that is cut by both ends. It is
    * read as it stands at the host's registers (HOST-05), a byte a cycle after its address; it must not
    * change until there is a result: true if there was an answer, which can then be read like that too
    * (counter at 4, data from 8 on).
    */
  val request        = IO(Flipped(Decoupled()))
  val requestAddress = IO(Output(UInt(4.W)))
  val requestData    = IO(Input(UInt(8.W)))
  val result         = IO(Output(Valid(Bool())))
  val resultAddress  = IO(Input(UInt(4.W)))
  val resultData     = IO(Output(UInt(8.W)))

  /** Pulses: sounders off until the next alarm; alarms end, detectors begin anew. */
  val silence    = IO(Input(Bool()))
  val resetAlarm = IO(Input(Bool()))

  /** What happens, in words of [[flyframe.protocol.MasterEvent]]; an event whose first word is not taken may
    * be withdrawn. `nextEvent` is the number that the next event gets or the one on its way has. Records are
    * taken only with room for records, changes of state told only with room for states.
    */
  val event          = IO(Decoupled(UInt(16.W)))
  val nextEvent      = IO(Input(UInt(16.W)))
  val roomForRecords = IO(Input(Bool()))
  val roomForStates  = IO(Input(Bool()))

  /** Status word of the master, frames sent in vain: for events. */
  val status     = IO(Input(UInt(19.W)))
  val framesLost = IO(Input(UInt(16.W)))

  val state = IO(Output(new LineState))

  /** A frame was sent in vain: for counting. */
  val lost = IO(Output(Bool()))

  /** The table of slaves, see [[SlaveTable]]. */
  val look        = IO(Input(UInt(10.W)))
  val lookData    = IO(Output(UInt(8.W)))
  val window      = IO(Input(UInt(8.W)))
  val windowByte  = IO(Input(UInt(3.W)))
  val windowState = IO(Output(UInt(8.W)))
  val expect      = IO(Flipped(Valid(UInt(16.W))))

  private val most                                    = maxSubTelegrams min Most
  private val exchange                                = Module(new LineExchange(linePorts))
  private val writer                                  = Module(new DatagramWriter)
  private val scheduler                               = Module(new Scheduler(maxSlaves, most, linePorts))
  private val ends                                    = Module(new LineEnds(maxSlaves, linePorts))
  private val scanner                                 = Module(new SlaveScanner(maxSlaves))
  private val orders                                  = Module(new OrderSender(maxSlaves))
  private val records                                 = Module(new RecordReader(maxSlaves, linePorts))
  private val events                                  = Module(new EventWriter(maxSlaves))
  private val slot                                    = Module(new EventSlot)
  private val table                                   = Module(new SlaveTable(maxSlaves))
  private val cyclic                                  = Module(new CyclicState)
  private val atSecond                                = scheduler.atSecond
  private val answer                                  = exchange.answer
  private def isKind(kind: DatagramKind.Type): Bool   = scheduler.kind === kind
  private def composes(kind: DatagramKind.Type): Bool = scheduler.composes && isKind(kind)
  private def takes(kind: DatagramKind.Type): Bool    = scheduler.taken && isKind(kind)

  // Frames.
  exchange.step       := step
  exchange.in         := in
  out                 := exchange.out
  exchange.source     := source
  exchange.clear      := scheduler.begun
  exchange.atSecond   := atSecond
  exchange.byte       := writer.byte
  exchange.go         := scheduler.go
  exchange.timeout    := timeout
  exchange.retries    := (if (linePorts == 2) Mux(ends.inUse, retries, 0.U) else retries)
  exchange.read       := scheduler.number
  exchange.place      := scheduler.place
  exchange.keeps      := scheduler.hosts
  lost                := exchange.lost
  scheduler.step      := step
  scheduler.run       := run
  scheduler.cycle     := cycle
  scheduler.sending   := exchange.sending
  scheduler.done      := exchange.done
  scheduler.count     := exchange.count
  scheduler.answer    := answer(7, 0)
  scheduler.closed    := ends.closed
  scheduler.changed   := ends.changed
  scheduler.busy      := scanner.busy || records.busy
  scheduler.writing   := writer.busy
  scheduler.unitPlace := Mux(scheduler.isRecord, records.place, scanner.place)
  scheduler.request <> request

  // Their datagrams.
  scheduler.offers := MuxLookup(scheduler.kind, true.B)(
    Seq(
      DatagramKind.read        -> scanner.offers,
      DatagramKind.order       -> orders.offers,
      DatagramKind.host        -> scheduler.hosts.valid,
      DatagramKind.acknowledge -> records.offers
    )
  )
  scheduler.seeks := scanner.busy || orders.busy || records.seeks
  writer.start    := scheduler.write
  writer.kind     := scheduler.kind
  writer.position := Mux1H(
    Seq(
      isKind(DatagramKind.read)        -> scanner.position.pad(8),
      isKind(DatagramKind.order)       -> Cat(orders.order(1), orders.position.pad(7)),
      isKind(DatagramKind.acknowledge) -> records.index
    )
  )
  writer.orderAll := orders.toAll
  writer.base     := ends.base
  writer.frame    := scheduler.frame
  writer.word := Mux1H(
    Seq(
      isKind(DatagramKind.order)       -> orders.order,
      isKind(DatagramKind.acknowledge) -> records.ackWord,
      isKind(DatagramKind.confirm)     -> Mux(writer.place(0), life, confirmed)
    )
  )
  requestAddress  := writer.hostAddress
  writer.hostData := requestData

  // The ends.
  private val known     = RegInit(0.U(8.W)) // slaves in the table; reset: none
  private val isCrowded = ends.present > maxSlaves.U
  ends.atSecond      := atSecond
  ends.counted.valid := scheduler.counted
  ends.counted.bits  := answer
  ends.across        := exchange.fromSecond
  ends.silent        := scheduler.silent
  ends.over          := scheduler.over.valid
  ends.forget        := scheduler.stopped
  ends.expected      := Mux(listed, table.listed, 0.U)
  ends.position      := Mux(isKind(DatagramKind.order), orders.position, scanner.position)
  when(scheduler.sweep.valid) {
    known := 0.U
  }.elsewhen((ends.places > known || table.listed > known) && !known(bits)) { known := known + 1.U }

  // The table. Bits of a status word that was read:
  private def has(bits: Int): Bool = (table.data & bits.U).orR
  table.sweep         := scheduler.sweep
  table.write         := scanner.write
  table.writeAt       := Mux(scheduler.idle, events.readAt, scanner.writeAt)
  table.writeData     := scanner.writeData
  table.changes.valid := scanner.changes || events.tells
  table.changes.bits  := !scheduler.idle
  table.readAt        := Mux(scheduler.idle, events.readAt, scanner.readAt)
  when(scheduler.ordersMay) {
    table.readAt.position := orders.readAt
    table.readAt.word     := SlaveStateLayout.Status.word.U
  }
  table.window     := window
  table.look       := look
  table.expect     := expect
  windowState      := table.windowState
  table.windowByte := windowByte
  lookData         := table.lookData

  scanner.clears   := scheduler.sweep.valid
  scanner.begin    := scheduler.begun
  scanner.asks     := composes(DatagramKind.read)
  scanner.taken    := takes(DatagramKind.read)
  scanner.mine     := ends.mine
  scanner.gone     := ends.gone
  scanner.known    := known
  scanner.listed   := listed
  scanner.start    := scheduler.read || scheduler.ordered
  scanner.isOrder  := scheduler.ordered
  scanner.restarts := answer(15)
  scanner.answered := answer(15, 8)
  scanner.answer   := answer
  scanner.data     := table.data
  scanner.expected := table.expected

  orders.silence      := silence
  orders.resetAlarm   := resetAlarm
  orders.notes        := scheduler.notes
  scheduler.noting    := orders.noting
  orders.sounds       := has(SlaveStatus.Sounding)
  orders.smoke        := has(SlaveStatus.Alarm | SlaveStatus.Latched)
  orders.forget       := ends.changed || scheduler.stopped
  orders.begin        := scheduler.begun
  orders.asks         := composes(DatagramKind.order)
  orders.taken        := takes(DatagramKind.order)
  orders.mine         := ends.mine
  orders.done         := scanner.ordered
  orders.doneAt       := scanner.subject
  orders.over         := scheduler.over
  orders.crowded      := isCrowded
  scheduler.ordersDue := orders.due

  records.atSecond := atSecond
  records.begin    := scheduler.heeds || ends.changed
  records.start    := scheduler.record
  records.base     := ends.base
  records.answer   := answer
  records.told     := scheduler.told
  // Both records of a slave that is absent: in this cycle the one, in the next the other.
  private val alsoForgets = RegNext(scanner.forgets, false.B)
  private val forgets     = scanner.forgets || alsoForgets
  records.clears := scheduler.sweep.valid || forgets
  records.toldAt := Mux(
    scheduler.sweep.valid,
    scheduler.sweep.bits(bits, 0),
    Mux(forgets, Cat(alsoForgets, scanner.subject), Cat(answer(15), answer(bits + 7, 8)))
  )
  records.room      := roomForRecords
  records.nextEvent := nextEvent
  records.free      := slot.free
  records.begins    := slot.begins
  records.compose   := composes(DatagramKind.acknowledge)
  records.restart   := scheduler.begun
  records.taken     := takes(DatagramKind.acknowledge)
  records.ackPlace  := writer.place

  // Events.
  events.run        := scheduler.idle
  events.known      := known
  events.forget     := scheduler.stopped
  events.isWrong    := has(SlaveStatus.Wrong)
  events.untold     := table.untold
  events.status     := status
  events.present    := ends.present
  events.cut        := ends.cut
  events.framesLost := framesLost
  events.room       := roomForStates
  events.free       := slot.free
  slot.write        := events.fills || records.fills
  slot.place        := Mux(scheduler.idle, events.place, records.step)
  slot.kind         := Mux(scheduler.idle, events.kind, EventKind.Detector.U)
  slot.position     := Mux(scheduler.idle, events.owner, records.owner)
  slot.answer       := answer
  slot.data         := table.data
  slot.own          := events.own
  slot.offer        := events.offer || records.offer
  slot.cancel       := records.cancel
  event <> slot.event

  // State.
  cyclic.answer.valid := scheduler.surveyed
  cyclic.answer.bits  := answer
  cyclic.over.valid   := scheduler.over.valid
  cyclic.over.bits    := scheduler.over.bits && ends.whole
  cyclic.expires      := orders.expires
  cyclic.givenUp      := orders.givenUp
  cyclic.newAlarm     := records.newAlarm
  cyclic.newSound     := scanner.newSound
  cyclic.silence      := silence
  cyclic.resetAlarm   := resetAlarm
  private val isDead = RegInit(false.B) // reset: nobody has been asked
  private val isOpen = RegInit(false.B)
  when(scheduler.over.valid) {
    isDead := ends.present === 0.U
    isOpen := (linePorts == 2).B && !ends.closed
  }
  when(scheduler.stopped) {
    isDead := false.B
    isOpen := false.B
  }
  state.fire       := cyclic.fire
  state.sounding   := cyclic.sounding
  state.alarm      := cyclic.alarm
  state.dead       := isDead
  state.ringOpen   := isOpen
  state.ringClosed := ends.closed
  state.wrong      := events.wrong || isCrowded
  state.slaveFault := cyclic.slaveFault
  state.disabled   := cyclic.disabled
  state.testing    := cyclic.testing
  state.present    := ends.present
  state.known      := known
  state.cut        := ends.cut

  // The host's result. Of a ring that is cut both ends have answered: their counters are added, and the data
  // are those of the end where somebody was meant.
  private val isCounter = resultAddress(3, 1) === (ResultCounter / 2).U
  exchange.keptPlace := Mux(isCounter, AnswerWord.Counter.U, AnswerWord.Data.U + resultAddress(2, 1))
  private def byteOf(word: UInt): UInt = Mux(RegNext(resultAddress(0)), word(15, 8), word(7, 0))
  result.valid        := scheduler.over.valid && scheduler.hosts.valid
  result.bits         := scheduler.over.bits
  exchange.keptSecond := false.B
  resultData          := byteOf(exchange.kept)
  if (linePorts == 2) {
    val counter = Reg(UInt(CounterBits.W))
    val second  = Reg(Bool()) // somebody at the second end was meant
    when(request.fire) {
      counter := 0.U
      second  := false.B
    }.elsewhen(scheduler.hostCounted) {
      counter := counter + answer
      when(answer =/= 0.U) { second := atSecond }
    }
    exchange.keptSecond := second
    resultData          := byteOf(Mux(RegNext(isCounter), counter, exchange.kept))
  }
}

object LineMaster {

  /** Datagrams of a frame, at most: so many fit into its memory. */
  val Most = 16

  /** Where the host finds the working counter of its datagram. */
  private val ResultCounter = 4

  /** Bits of the working counter of both ends of a ring together: each slave adds 3 at most. */
  private val CounterBits = 10
}
