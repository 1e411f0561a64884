package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.mii.NibbleStream
import flyframe.protocol.{DetectorState, EventKind, MasterEvent, RecordLayout, SelfTest}
import flyframe.protocol.Command.{Aprd, Bwr, Fpwr}
import flyframe.registers.{AlarmRegisters, DlRegisters, StationRegisters}

/** Runs a line of alarm slaves (LM-01 to LM-10, docs/rules/alarm.md): counts and lists them, then, every
  * cycle, sends what the host has queued, acknowledgements, or an empty frame, and takes the alarm records
  * that come back. Slaves that no longer answer are lost until they do.
  *
  * @param maxSlaves
  *   slaves it can list, a power of two
  * @param maxSubTelegrams
  *   datagrams of a frame
  */
class LineMaster(maxSlaves: Int, maxSubTelegrams: Int) extends Module {
  import LineMaster._
  private val positionBits = log2Ceil(maxSlaves)

  /** Once per nibble slot. */
  val step   = IO(Input(Bool()))
  val in     = IO(Input(new NibbleStream))
  val out    = IO(Output(new NibbleStream))
  val source = IO(Input(UInt(48.W))) // MAC address, first byte in the low bits

  /** The host has set everything up: the line is to run. */
  val run = IO(Input(Bool()))

  /** Length of a cycle, time to wait for an answer, in slots of 40 ns; how often a frame is sent again. */
  val cycle   = IO(Input(UInt(20.W)))
  val timeout = IO(Input(UInt(16.W)))
  val retries = IO(Input(UInt(4.W)))

  /** A datagram of the host is `taken` and sent in the next cycle. It is read as it stands at the host's
    * registers (HOST-05), a byte a cycle after its address; it must not change until there is a result: true
    * if there was an answer, which can then be read like that too (counter at 4, data from 8 on).
    */
  val request        = IO(Flipped(Decoupled()))
  val requestAddress = IO(Output(UInt(4.W)))
  val requestData    = IO(Input(UInt(8.W)))
  val result         = IO(Output(Valid(Bool())))
  val resultAddress  = IO(Input(UInt(4.W)))
  val resultData     = IO(Output(UInt(8.W)))

  /** What happens, in words of [[MasterEvent]]. Records of slaves are taken only while there is `room`.
    * `nextEvent` is the number that the next event gets or the one on its way has, `firstEvent` that of the
    * oldest one which the server does not have (LM-10); both are low bits only.
    */
  val event      = IO(Decoupled(UInt(16.W)))
  val room       = IO(Input(Bool()))
  val nextEvent  = IO(Input(UInt(EventReporter.NumberBits.W)))
  val firstEvent = IO(Input(UInt(EventReporter.NumberBits.W)))

  /** How many slaves answer, and how many are in the table. */
  val present = IO(Output(UInt((positionBits + 1).W)))
  val known   = IO(Output(UInt((positionBits + 1).W)))

  /** Pulses: a new record tells of an alarm; a frame was sent in vain. */
  val alarm = IO(Output(Bool()))
  val lost  = IO(Output(Bool()))

  private object State extends ChiselEnum {

    /** Between frames: in `stopped` nothing is sent; `pause` waits for the next cycle; `doubt` goes through
      * all slaves after a lost frame, since what they were told may not have arrived.
      *
      * A frame: `load` fetches the host's datagram from its registers; `clear` begins the frame; `choose`
      * looks for a slave that is to be told something; `offer` and `data` hand a datagram over; `go` sends
      * the frame, and `await` waits for its answer.
      *
      * An answer: `fetch` takes the next datagram of it, `look` sees what kind it is; in `taken` it is an
      * acknowledgement of ours, in `own` the only datagram of the frame; `skip` goes on to the next one.
      *
      * An alarm record: `record` sees whether the datagram is one; `compare` looks for its slave; `recall`,
      * `epoch`, `sequence` and `judge` find out whether it is new.
      *
      * The number of slaves: `count` takes it, `meet` decides what follows from it; `lose` and `losing`
      * report those that do not answer any more.
      *
      * A new slave: `scan` asks it something, `list` and `heed` take its answer, `know` and `introduce` put
      * it into the table; `equal` looks for another one with its node ID, `settle` and `gap` compare it with
      * the one before it; `next` goes on to the slave behind it.
      *
      * An event: `emit` hands it over, word by word.
      */
    val stopped, pause, doubt, load, clear, choose, offer, data, go, await, fetch, look, taken, own, skip,
        record, compare, recall, epoch, sequence, judge, count, meet, lose, losing, scan, list, heed, know,
        introduce, equal, settle, gap, next, emit = Value
  }
  import State._
  private val state  = RegInit(stopped)   // reset: until the host says run
  private val behind = Reg(State())       // after an event
  private val resume = Reg(State())       // after an answer of a single datagram
  private val timer  = RegInit(0.U(20.W)) // slots of this cycle; reset: none
  private val beat   = RegInit(0.U(4.W))  // cycles since the slaves were counted; reset: count at once
  private val single = Reg(Bool())        // the frame has one datagram of our own: its answer is for `resume`
  private val byHost = Reg(Bool())        // the frame begins with the host's datagram
  private val ofHost = Reg(Bool())        // that is the one at hand
  private val index  = RegInit(0.U(8.W))  // of the next datagram; reset: any
  private val byte   = Reg(UInt(4.W))     // of a datagram: as at the host's registers
  private val place    = Reg(UInt((positionBits + 1).W))    // slave at hand
  private val search   = Reg(UInt((positionBits + 1).W))    // slave looked up
  private val turn     = RegInit(0.U(positionBits.W))       // slave that is told something next; reset: any
  private val number   = Reg(UInt(log2Ceil(Answers + 1).W)) // answer at hand
  private val here     = RegInit(0.U((positionBits + 1).W)) // slaves that answer; reset: none
  private val listed   = RegInit(0.U((positionBits + 1).W)) // slaves in the table; reset: none
  private val part     = Reg(UInt(3.W))                     // what of a slave is being asked
  private val isOne    = Reg(Bool())                        // one slave has answered
  private val node     = Reg(UInt(16.W))                    // its node ID
  private val second   = Reg(UInt(16.W))                    // its DL status, then its twin
  private val hasTwin  = RegInit(false.B)                   // another one has its node ID; reset: none
  private val patience = RegInit(0.U(10.W))                 // cycles its host was waited for; reset: none
  private val unsure   = RegInit(false.B) // a confirmation may not have arrived; reset: none
  private val isListed = Reg(Bool())      // the record at hand is of a slave on the list
  private val isAlarm  = Reg(Bool())      // it tells of an alarm
  private val isOld    = Reg(Bool())      // its number has been, if its epoch is the same
  private val itsEpoch = Reg(UInt(8.W))
  private val answered = Reg(UInt(16.W))
  private val counted  = Mux(answered > maxSlaves.U, maxSlaves.U, answered)(positionBits, 0)
  present := here
  known   := listed

  private val table = Module(new SlaveTable(maxSlaves))
  table.read               := search
  table.changeNode.valid   := false.B
  table.changeNode.bits    := node
  table.changeRecord.valid := false.B
  table.changeAnswer.valid := false.B
  table.changeFlags.valid  := false.B
  table.changeFlags.bits   := table.flags

  /** In a loop over slaves: the table shows the one before `search`. */
  private val primed = Reg(Bool())
  primed := false.B

  private val exchange = Module(new LineExchange(maxSubTelegrams min Most, Answers))
  private val wanted = WireDefault(AnswerWord.Adp.U(3.W)) // which word of the answer comes in the next cycle
  private val answer = exchange.answer
  exchange.step                    := step
  exchange.in                      := in
  exchange.source                  := source
  exchange.timeout                 := timeout
  exchange.retries                 := retries
  exchange.keeps                   := byHost
  exchange.keptAddress             := resultAddress
  exchange.read                    := number
  exchange.place                   := wanted
  exchange.clear                   := state === clear && !exchange.composing
  exchange.go                      := state === go && !exchange.composing
  resultData                       := exchange.keptData
  out                              := exchange.out
  lost                             := exchange.lost
  table.changeRecord.bits.sequence := answer
  table.changeRecord.bits.epoch    := itsEpoch
  table.changeRecord.bits.event    := nextEvent
  table.changeAnswer.bits          := answer

  // The datagram at hand. Its data, if not the host's, are one word.
  private val asks = Reg(new Bundle {
    val command = UInt(8.W)
    val address = Vec(4, UInt(8.W))
    val length  = UInt(4.W)
    val content = UInt(16.W)
  })
  private val settled = Reg(Bool()) // `requestData` is that at `byte`, or an event's word has come
  settled                        := false.B
  exchange.datagram.valid        := state === offer
  exchange.datagram.bits.command := asks.command
  exchange.datagram.bits.index   := index
  exchange.datagram.bits.address := asks.address.asUInt
  exchange.datagram.bits.length  := asks.length
  exchange.data.valid            := state === data && settled
  exchange.data.bits := Mux(ofHost, requestData, Mux(byte(0), asks.content(15, 8), asks.content(7, 0)))
  requestAddress     := byte
  request.ready      := false.B
  result.valid       := false.B
  result.bits        := exchange.done.bits || state === look
  alarm              := false.B

  private def ask(command: Int, adp: UInt, ado: UInt, length: Int, content: UInt = 0.U): Unit = {
    asks.command := command.U
    asks.address := Cat(ado.pad(16)(15, 0), adp.pad(16)(15, 0)).asTypeOf(asks.address)
    asks.length  := length.U
    asks.content := content
    ofHost       := false.B
  }

  /** One datagram in a frame of its own; its working counter is looked at in state `next`. */
  private def askAlone(next: State.Type): Unit = {
    single := true.B
    byHost := false.B
    resume := next
    state  := clear
  }

  // An event: which one, and the word of it that is next.
  private val kind = Reg(UInt(3.W))
  private val word = Reg(UInt(3.W))
  private def emitThen(next: State.Type, what: UInt): Unit = {
    kind   := what
    word   := 0.U
    behind := next
    state  := emit
  }
  private def isKind(k: Int) = kind === k.U
  private val ofRecord       = isKind(EventKind.Detector)
  private val newcomer       = isKind(EventKind.Present) || isKind(EventKind.Found)
  private val position =
    Mux(ofRecord, table.index, Mux(isKind(EventKind.Scanned), counted, place))
  private val words = Seq(
    MasterEvent.Kind -> Cat(kind.pad(8), position.pad(8)),
    MasterEvent.Node -> Mux(
      isKind(EventKind.Scanned),
      answered,
      Mux(ofRecord || isKind(EventKind.Lost), table.node, node)
    ),
    MasterEvent.Sequence -> Mux(
      isKind(EventKind.Gap),
      table.node,
      Mux(ofRecord, answer, Mux(newcomer || isKind(EventKind.Duplicate), second, 0.U))
    ),
    MasterEvent.State    -> Mux(ofRecord || newcomer, Cat(answer(7, 0), answer(15, 8)), 0.U),
    MasterEvent.TimeHigh -> Mux(ofRecord, answer, 0.U),
    MasterEvent.TimeLow  -> Mux(ofRecord, answer, 0.U)
  )
  event.valid := state === emit && settled
  event.bits  := MuxLookup(word, 0.U(16.W))(words.map { case (n, w) => n.U -> w })

  when(step && timer =/= 0.U) { timer := timer - 1.U }
  switch(state) {
    is(stopped) {
      beat   := 0.U
      byHost := false.B
      when(run) { state := pause }
    }
    is(pause) {
      search := 0.U
      byte   := 0.U
      when(!run) {
        state  := stopped
        here   := 0.U
        listed := 0.U
      }.elsewhen(unsure) {
        state := doubt
      }.elsewhen(timer === 0.U) {
        // The host comes first, but it does not keep us from counting.
        val counts = beat === 0.U || here === 0.U
        val hosts  = request.valid && !(counts && byHost)
        timer  := cycle
        single := false.B
        byHost := hosts
        state  := clear
        when(!(hosts && counts)) { beat := beat + 1.U }
        when(hosts) {
          request.ready := true.B
          state         := load
        }.elsewhen(counts) {
          // Every slave that is counted answers to its node ID from now on: one may have restarted unnoticed.
          ask(Bwr, 0.U, AliasEnable.U, 1, 1.U)
          askAlone(count)
        }
      }
    }
    is(doubt) { // after a lost frame all is to be confirmed anew
      primed := true.B
      search := search + 1.U
      when(primed) {
        table.changeFlags.valid          := true.B
        table.changeFlags.bits.confirmed := !table.flags.heard
      }
      when(search === listed) {
        unsure := false.B
        state  := pause
      }
    }

    // A frame: the host's datagram, one of our own, or as many acknowledgements as fit.
    is(load) {
      settled := !settled
      ofHost  := true.B
      when(settled) {
        byte := byte + 1.U
        when(byte === Command.U) { asks.command := requestData }
        when(byte === Length.U) { asks.length := requestData min MostBytes.U }
        for (i <- 0 until 4) when(byte === (Address + i).U) { asks.address(i) := requestData }
        when(byte === (HostData - 1).U) { state := clear }
      }
    }
    is(clear) {
      search := turn
      when(!exchange.composing) {
        state := Mux(single || byHost, offer, choose)
      } // a late answer ends a frame
    }
    is(choose) {
      val hasIt    = (table.record.event - firstEvent).head(1).asBool
      val confirms = table.flags.heard && !table.flags.confirmed && hasIt
      val due      = table.flags.due
      primed := true.B
      search := search + 1.U
      when(primed) {
        when(search <= here && (due || confirms)) {
          // No confirmation in the frame of the acknowledgement: the record may ride in it too.
          turn   := table.index
          search := search
          state  := go
          when(!exchange.full) {
            ask(
              Fpwr,
              table.node,
              Mux(due, AlarmRegisters.Acknowledge.U, AlarmRegisters.Confirm.U),
              2,
              Mux(due, table.answer, table.record.sequence)
            )
            table.changeFlags.valid     := true.B
            table.changeFlags.bits.told := due || table.flags.told
            when(due) { table.changeFlags.bits.due := false.B }
              .otherwise { table.changeFlags.bits.confirmed := true.B }
            state := offer
          }
        }.elsewhen(search >= here) {
          turn  := 0.U
          state := go
        }
      }
    }
    is(offer) {
      byte := HostData.U
      when(exchange.datagram.ready) {
        index := index + 1.U
        state := Mux(asks.length === 0.U, Mux(single, go, choose), data)
      }
    }
    is(data) {
      settled := !exchange.data.fire
      when(exchange.data.fire) {
        byte := byte + 1.U
        when(byte(2, 0) === (asks.length - 1.U)(2, 0)) { state := Mux(single, go, choose) }
      }
    }
    is(go) { when(!exchange.composing) { state := await } }
    is(await) {
      number := single // records first, then the answer to our own datagram
      when(exchange.done.valid) {
        state := fetch
        when(!exchange.done.bits) {
          result.valid := byHost
          // Nobody answers: as if none were counted. Else it is tried again, in the next cycle.
          answered := 0.U
          place    := 0.U
          part     := 0.U
          state    := Mux(single && resume === count, lose, pause)
          beat     := 0.U
          unsure   := true.B
        }
      }
    }
    is(fetch) {
      wanted := AnswerWord.Kind.U
      state  := look
      when(number >= exchange.count) {
        number := 0.U
        state  := Mux(single, own, pause)
      }
    }
    is(own) {
      wanted := AnswerWord.Counter.U
      state  := resume
    }
    is(look) {
      val appended = answer(15)
      wanted := Mux(appended, AnswerWord.Ado.U, AnswerWord.Counter.U)
      when(appended) {
        state := Mux(answer(10, 0) === RecordLayout.bytes.U, record, skip)
      }.elsewhen(byHost && number === 0.U) {
        result.valid := true.B
        state        := skip
      }.otherwise { state := taken }
    }
    is(taken) {
      when(answer === 0.U) { unsure := true.B } // an acknowledgement that nobody took
      state := skip
    }
    is(skip) {
      number := number + 1.U
      state  := fetch
    }

    // An alarm record: new if it is newer than the last one of its slave. That of a slave which is not on the
    // list waits.
    is(record) {
      search := 0.U
      state  := Mux(answer === AlarmRegisters.Record.U, compare, skip)
    }
    is(compare) {
      val isHere = primed && table.node === answer
      primed   := true.B
      isListed := isHere
      search   := Mux(isHere, table.index, search + 1.U)
      when(isHere || search === listed) { state := recall }
    }
    is(recall) {
      wanted := StateEpoch.U
      state  := epoch
    }
    is(epoch) {
      wanted   := Sequence.U
      itsEpoch := answer(15, 8)
      isAlarm  := answer(7, 0) === DetectorState.Alarm.U
      state    := sequence
    }
    is(sequence) {
      val distance = answer - table.record.sequence
      wanted := Sequence.U
      isOld  := distance === 0.U || distance(15)
      state  := judge
    }
    is(judge) {
      val isSeen = isListed && table.flags.heard && table.record.epoch === itsEpoch && isOld
      alarm := !isSeen && isAlarm
      state := skip
      when(isSeen) { // it has been reported again: it was not there when that was confirmed
        table.changeAnswer.valid         := true.B
        table.changeFlags.valid          := true.B
        table.changeFlags.bits.due       := !table.flags.told
        table.changeFlags.bits.told      := false.B
        table.changeFlags.bits.confirmed := false.B
      }.elsewhen(isListed && room) { emitThen(skip, EventKind.Detector.U) }
    }

    // The number of slaves that answer.
    is(count) {
      answered := answer
      state    := meet
    }
    is(meet) {
      place := Mux(counted < here, counted, here)
      part  := 0.U
      state := Mux(counted < here, lose, Mux(counted > here, scan, pause))
    }
    is(lose) {
      search := place
      when(place >= here) {
        here  := counted
        state := pause
      }.otherwise { emitThen(losing, EventKind.Lost.U) }
    }
    is(losing) {
      place := place + 1.U
      state := lose
    }

    // What new slaves say of themselves.
    is(scan) {
      val position = 0.U(16.W) - place
      switch(part) {
        is(0.U) { ask(Bwr, 0.U, AliasEnable.U, 1, 1.U) } // from now on they answer to their node ID
        is(1.U) { ask(Bwr, 0.U, AlarmRegisters.Command.U, 1, AlarmRegisters.Repeat.U) }
        is(2.U) { ask(Aprd, position, StationRegisters.Alias.U, 2) }
        is(3.U) { ask(Aprd, position, DlRegisters.Status.U, 2) }
        is(4.U) { ask(Aprd, position, AlarmRegisters.SelfTest.U, 2) }
      }
      askAlone(list)
    }
    is(list) {
      wanted := AnswerWord.Data.U
      isOne  := answer === 1.U
      state  := heed
      when(answer === 0.U && (part === 2.U || part === 3.U)) { // gone again
        beat  := 0.U
        state := pause
      }
    }
    is(heed) { // self-test and epoch stay where they are
      wanted := AnswerWord.Data.U
      part   := part + 1.U
      search := place
      state  := scan
      switch(part) {
        is(2.U) { node := answer }
        is(3.U) { second := answer }
        is(4.U) {
          state := know
          // Its host is still starting: later, but not for ever.
          when(isOne && answer(7, 0) === SelfTest.NotRun.U && !patience.andR) {
            patience := patience + 1.U
            part     := 0.U
            beat     := 0.U
            state    := pause
          }
        }
      }
    }
    is(know) { state := introduce }
    is(introduce) {
      val isSame = place < listed && table.node === node
      emitThen(equal, Mux(isSame, EventKind.Found.U, EventKind.Present.U))
      table.changeNode.valid           := true.B
      table.changeFlags.valid          := true.B
      table.changeFlags.bits.heard     := isSame && table.flags.heard
      table.changeFlags.bits.confirmed := !isSame || table.flags.confirmed
      table.changeFlags.bits.due       := false.B
      table.changeFlags.bits.told      := false.B
      patience                         := 0.U
      search                           := 0.U
      when(place >= listed) { listed := place + 1.U }
    }
    is(equal) { // to one before it
      primed := true.B
      search := search + 1.U
      when(primed && search <= place && table.node === node) {
        hasTwin := true.B
        second  := table.index
      }
      when(search >= place) {
        search := table.index // that before it
        state  := settle
      }
    }
    is(settle) { state := gap }
    is(gap) {
      state := next
      when(hasTwin) {
        hasTwin := false.B
        emitThen(gap, EventKind.Duplicate.U)
      }.elsewhen(place =/= 0.U && node =/= table.node + 1.U) { emitThen(next, EventKind.Gap.U) }
    }
    is(next) {
      here  := place + 1.U
      place := place + 1.U
      part  := FirstQuestion.U
      state := scan
      when(place + 1.U === counted) { emitThen(pause, EventKind.Scanned.U) }
    }

    is(emit) {
      wanted := MuxLookup(word, Sequence.U(3.W))(
        Seq(
          MasterEvent.State.U    -> Mux(ofRecord, StateEpoch.U, AnswerWord.Data.U),
          MasterEvent.TimeHigh.U -> TimeHigh.U,
          MasterEvent.TimeLow.U  -> TimeLow.U
        )
      )
      settled := !event.fire
      when(event.fire) {
        word := word + 1.U
        when(word === (MasterEvent.Words - 1).U) { state := behind }
        when(ofRecord && word === MasterEvent.Sequence.U) {
          table.changeRecord.valid         := true.B
          table.changeAnswer.valid         := true.B
          table.changeFlags.valid          := true.B
          table.changeFlags.bits.heard     := true.B
          table.changeFlags.bits.confirmed := false.B
          table.changeFlags.bits.due       := true.B
          table.changeFlags.bits.told      := false.B
        }
      }
    }
  }
}

object LineMaster {

  /** Answers looked at per frame; datagrams of our own among them, at most. */
  private val Answers = 32
  private val Most    = 16

  /** Words of a record among those of an answer. */
  private val Sequence   = AnswerWord.Data + RecordLayout.Sequence.word
  private val StateEpoch = AnswerWord.Data + RecordLayout.State.word
  private val TimeLow    = AnswerWord.Data + RecordLayout.Time.word
  private val TimeHigh   = TimeLow + 1

  /** Bytes of a datagram of the host, as they stand at its registers; data, at most. */
  private val Command   = 0
  private val Length    = 1
  private val Address   = 4
  private val HostData  = 8
  private val MostBytes = 8

  /** The first thing that only one slave is asked for. */
  private val FirstQuestion = 2
  private val AliasEnable   = DlRegisters.Control + 3
}
