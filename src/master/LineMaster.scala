package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.alarm.DetectorState
import flyframe.memory.{DualPortRam, RamQueue}
import flyframe.mii.NibbleStream
import flyframe.registers.AlarmRegisters

/** Something the server is to know of (LM-08). */
class MasterEvent extends Bundle {

  /** A code of [[EventKind]], which tells what the other fields mean. */
  val kind     = UInt(8.W)
  val position = UInt(8.W)
  val node     = UInt(16.W)
  val sequence = UInt(16.W)
  val state    = UInt(8.W)
  val epoch    = UInt(8.W)
  val time     = UInt(32.W)
}

/** Kinds of events: written down here for RTL, model and server. */
object EventKind {

  /** An alarm record of a slave. */
  val Detector = 1

  /** The line has been looked through; position: number of slaves listed, node: of those that answer. */
  val Scanned = 2

  /** A slave is there; state: result of its self-test, sequence: its DL status. */
  val Present = 3

  /** A slave that was there does not answer any more; it answers again. */
  val Lost  = 4
  val Found = 5

  /** A slave has the same node ID as that at position `sequence`. */
  val Duplicate = 6

  /** A slave's node ID is not that of the one before it (`sequence`) plus one. */
  val Gap = 7

  /** What became of a command of the server, from the master's host; position: the command, sequence: low
    * bits of its counter, state: result.
    */
  val Command = 8
}

/** A datagram of the host, up to eight data bytes. */
class HostDatagram extends Bundle {
  val command = UInt(8.W)
  val address = UInt(32.W)
  val length  = UInt(4.W)
  val data    = UInt(64.W)
}

object HostDatagram {

  /** Data bytes, at most. */
  val MostBytes = 8
}

/** Runs a line of alarm slaves (LM-01 to LM-09, docs/behaviour.md): counts and lists them, then, every cycle,
  * sends what the host has queued, acknowledgements, or an empty frame, and takes the alarm records that come
  * back. Slaves that no longer answer are lost until they do.
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

  /** The host has set everything up. */
  val run = IO(Input(Bool()))

  /** Length of a cycle, time to wait for an answer, in slots of 40 ns; how often a frame is sent again. */
  val cycle   = IO(Input(UInt(20.W)))
  val timeout = IO(Input(UInt(16.W)))
  val retries = IO(Input(UInt(4.W)))

  /** A datagram to be sent in the next cycle, and its working counter; not valid: there was no answer. */
  val host = IO(Flipped(Decoupled(new HostDatagram)))
  val hostResult = IO(Output(Valid(new Bundle {
    val answered = Bool()
    val counter  = UInt(16.W)
    val data     = UInt(64.W)
  })))

  /** What happens; records are only taken while there is `room`. Numbers of the next event, and of the oldest
    * one that the server does not have (LM-10).
    */
  val event      = IO(Decoupled(new MasterEvent))
  val room       = IO(Input(Bool()))
  val nextEvent  = IO(Input(UInt(16.W)))
  val firstEvent = IO(Input(UInt(16.W)))

  /** Slaves that answer; slaves known. */
  val present = IO(Output(UInt((positionBits + 1).W)))
  val known   = IO(Output(UInt((positionBits + 1).W)))

  /** An alarm has come; a frame was sent in vain. */
  val alarm = IO(Output(Bool()))
  val lost  = IO(Output(Bool()))

  private val exchange = Module(new LineExchange(maxSubTelegrams, Answers))
  exchange.step    := step
  exchange.in      := in
  exchange.source  := source
  exchange.timeout := timeout
  exchange.retries := retries
  out              := exchange.out
  lost             := exchange.lost

  /** What is remembered of a slave. */
  private class Slave extends Bundle {
    val node      = UInt(16.W)
    val sequence  = UInt(16.W) // of its last record
    val epoch     = UInt(8.W)
    val event     = UInt(16.W) // number of the event which that was
    val heard     = Bool()     // there was one
    val confirmed = Bool()     // it has been told that the server has it
  }
  private val table  = DualPortRam(maxSlaves, (new Slave).getWidth)(clock)
  private val place  = Reg(UInt((positionBits + 1).W)) // slave at hand
  private val search = Reg(UInt((positionBits + 1).W)) // slave compared with it
  private val slave  = Reg(new Slave)                  // that at hand
  private val stored = table.io.readData.asTypeOf(new Slave)
  table.io.write        := false.B
  table.io.writeAddress := place
  table.io.writeData    := slave.asUInt
  table.io.readAddress  := search

  // Acknowledgements and confirmations to be sent.
  private class Acknowledgement extends Bundle {
    val node     = UInt(16.W)
    val sequence = UInt(16.W)
    val confirms = Bool()
  }
  private val acknowledgements = Module(new RamQueue(new Acknowledgement, Answers))
  acknowledgements.in.valid         := false.B
  acknowledgements.in.bits.node     := exchange.answer.address(15, 0)
  acknowledgements.in.bits.sequence := exchange.answer.data(15, 0)
  acknowledgements.in.bits.confirms := false.B
  acknowledgements.out.ready        := false.B

  private object State extends ChiselEnum {

    /** stopped; pause: until the next cycle; confirm: what the server has; clear, choose, offer, data, rest,
      * go, wait: a frame; look: at an answer; compare: an alarm record with the last one of its slave; count:
      * what the number of slaves means; lose, losing: slaves go; scan, list: what is asked of new ones; know,
      * equal, gap, next: what becomes of them; emit: an event.
      */
    val stopped, pause, confirm, clear, choose, offer, data, go, await, fetch, look, compare, count, lose,
        losing, scan, list, know, equal, gap, next, emit = Value
  }
  import State._
  private val state  = RegInit(stopped)   // reset: until the host says run
  private val behind = Reg(State())       // after an event
  private val resume = Reg(State())       // after an answer of a single datagram
  private val timer  = RegInit(0.U(20.W)) // slots of this cycle; reset: none
  private val beat   = RegInit(0.U(4.W))  // cycles since the slaves were counted; reset: count at once
  private val single = Reg(Bool())        // the frame has one datagram of our own: its answer is for `resume`
  private val byHost = Reg(Bool())        // the frame begins with the host's datagram
  private val asks   = Reg(new HostDatagram)
  private val index  = RegInit(0.U(8.W))  // of the next datagram; reset: any
  private val byte   = Reg(UInt(4.W))
  private val number   = Reg(UInt(log2Ceil(Answers + 1).W)) // answer at hand
  private val here     = RegInit(0.U((positionBits + 1).W)) // slaves that answer; reset: none
  private val listed   = RegInit(0.U((positionBits + 1).W)) // slaves in the table; reset: none
  private val counted  = Reg(UInt((positionBits + 1).W))
  private val answered = Reg(UInt(16.W))
  private val part     = Reg(UInt(3.W))                     // what of a slave is being read
  private val status   = Reg(UInt(16.W))                    // its DL status
  private val selfTest = Reg(UInt(8.W))
  private val before   = Reg(UInt(16.W))                    // node ID of the slave before it
  private val hasTwin  = RegInit(false.B)                   // another one has its node ID; reset: none
  private val twin     = Reg(UInt(positionBits.W))
  private val patience = RegInit(0.U(10.W))                 // cycles its host was waited for; reset: none
  private val unsure = RegInit(false.B) // a confirmation may not have arrived; reset: none
  private val event0 = Reg(new MasterEvent)
  present := here
  known   := listed

  private val more = state === choose && acknowledgements.out.valid && !exchange.full
  exchange.clear                 := state === clear
  exchange.datagram.valid        := state === offer
  exchange.datagram.bits.command := asks.command
  exchange.datagram.bits.index   := index
  exchange.datagram.bits.address := asks.address
  exchange.datagram.bits.length  := asks.length
  exchange.data.valid            := state === data
  exchange.data.bits             := asks.data(7, 0)
  exchange.go                    := state === go && !exchange.composing
  exchange.read                  := number
  event.valid                    := state === emit
  event.bits                     := event0
  host.ready                     := false.B
  hostResult.valid               := false.B
  hostResult.bits.answered       := exchange.done.bits
  hostResult.bits.counter        := exchange.answer.counter
  hostResult.bits.data           := exchange.answer.data
  alarm                          := false.B

  private def ask(command: Int, adp: UInt, ado: Int, length: Int, content: UInt = 0.U): Unit = {
    asks.command := command.U
    asks.address := Cat(ado.U(16.W), adp.pad(16)(15, 0))
    asks.length  := length.U
    asks.data    := content
  }

  /** One datagram in a frame of its own; its answer is looked at in state `next`. */
  private def askAlone(next: State.Type): Unit = {
    single := true.B
    byHost := false.B
    resume := next
    state  := clear
  }
  private def emitThen(next: State.Type, kind: UInt, position: UInt, node: UInt): Unit = {
    event0.kind     := kind
    event0.position := position
    event0.node     := node
    event0.sequence := 0.U
    event0.state    := 0.U
    event0.epoch    := 0.U
    event0.time     := 0.U
    behind          := next
    state           := emit
  }
  private val answer = exchange.answer

  when(step && timer =/= 0.U) { timer := timer - 1.U }
  switch(state) {
    is(stopped) {
      beat := 0.U
      when(run) { state := pause }
    }
    is(pause) {
      number := 0.U
      when(!run) {
        state  := stopped
        here   := 0.U
        listed := 0.U
      }.elsewhen(timer === 0.U) {
        timer  := cycle
        beat   := beat + 1.U
        single := false.B
        byHost := host.valid
        search := 0.U
        state  := confirm
        when(host.valid) {
          host.ready := true.B
          asks       := host.bits
        }.elsewhen(beat === 0.U || here === 0.U) {
          // Every slave that is counted answers to its node ID from now on: one may have restarted unnoticed.
          ask(Bwr, 0.U, AliasEnable, 1, 1.U)
          askAlone(count)
        }
      }
    }

    // What the server has is confirmed to the slaves, once; `stored` is the slave before `search`. After a lost
    // frame all is to be confirmed anew: a round only marks it.
    is(confirm) {
      val hasIt = stored.heard && (stored.event - firstEvent)(15)
      val entry = WireDefault(stored)
      search                            := search + 1.U
      table.io.writeAddress             := search - 1.U
      table.io.writeData                := entry.asUInt
      acknowledgements.in.bits.node     := stored.node
      acknowledgements.in.bits.sequence := stored.sequence
      acknowledgements.in.bits.confirms := true.B
      when(search =/= 0.U) {
        when(unsure) {
          entry.confirmed := !stored.heard
          table.io.write  := true.B
        }.elsewhen(hasIt && !stored.confirmed) {
          entry.confirmed           := true.B
          acknowledgements.in.valid := true.B
          table.io.write            := acknowledgements.in.ready
        }
      }
      when(search >= Mux(unsure, listed, here)) {
        unsure := false.B
        state  := clear
      }
    }

    // A frame: the host's datagram, one of our own, or as many acknowledgements as fit.
    is(clear) { state := Mux(single || byHost, offer, choose) }
    is(choose) {
      acknowledgements.out.ready := more
      state                      := Mux(more, offer, go)
      when(more) {
        val a = acknowledgements.out.bits
        ask(Fpwr, a.node, AlarmRegisters.Acknowledge, 2, a.sequence)
        when(a.confirms) { asks.address := Cat(AlarmRegisters.Confirm.U(16.W), a.node) }
      }
    }
    is(offer) {
      byte := asks.length
      when(exchange.datagram.ready) {
        index := index + 1.U
        state := Mux(asks.length === 0.U, Mux(single, go, choose), data)
      }
    }
    is(data) {
      when(exchange.data.ready) {
        asks.data := asks.data >> 8
        byte      := byte - 1.U
        when(byte === 1.U) { state := Mux(single, go, choose) }
      }
    }
    is(go) { when(!exchange.composing) { state := await } }
    is(await) {
      when(exchange.done.valid) {
        number := 0.U
        state  := fetch
        when(!exchange.done.bits) {
          hostResult.valid := byHost
          // Nobody answers: as if none were counted. Else it is tried again, in the next cycle.
          counted := 0.U
          place   := 0.U
          part    := 0.U
          state   := Mux(single && resume === count, lose, pause)
          beat    := 0.U
          unsure  := true.B
        }
      }
    }
    is(fetch) { state := Mux(number === exchange.count, pause, look) }
    is(look) {
      search := 0.U
      state  := fetch
      number := number + 1.U
      when(answer.appended) {
        val isRecord = answer.address(31, 16) === AlarmRegisters.Record.U && answer.length === RecordBytes.U
        when(isRecord && acknowledgements.in.ready) {
          number := number
          state  := compare
        }
      }.elsewhen(single) {
        number := number
        state  := resume
      }.elsewhen(byHost && number === 0.U) {
        hostResult.valid         := true.B
        hostResult.bits.answered := true.B
      }.elsewhen(answer.counter === 0.U) { unsure := true.B } // an acknowledgement that nobody took
    }

    // An alarm record: new if it is newer than the last one of its slave. `stored` is the slave before `search`.
    // That of a slave which is not on the list waits.
    is(compare) {
      val found    = search =/= 0.U && stored.node === answer.address(15, 0)
      val distance = answer.data(15, 0) - stored.sequence
      val isSeen = stored.heard && stored.epoch === answer.data(31, 24) && (distance === 0.U || distance(15))
      val takes  = found && !isSeen && room
      search := search + 1.U
      when(found || search === listed) {
        acknowledgements.in.valid := found && (isSeen || takes)
        alarm                     := !(found && isSeen) && answer.data(23, 16) === DetectorState.Alarm.U
        number                    := number + 1.U
        state                     := fetch
        // It has been reported again: it was not there when that was confirmed.
        val entry = WireDefault(stored)
        entry.confirmed       := false.B
        table.io.write        := found && isSeen
        table.io.writeAddress := search - 1.U
        table.io.writeData    := entry.asUInt
        when(takes) {
          emitThen(fetch, EventKind.Detector.U, (search - 1.U).pad(8), stored.node)
          event0.sequence := answer.data(15, 0)
          event0.state    := answer.data(23, 16)
          event0.epoch    := answer.data(31, 24)
          event0.time     := answer.data(63, 32)
          slave.node      := stored.node
          slave.sequence  := answer.data(15, 0)
          slave.epoch     := answer.data(31, 24)
          slave.heard     := true.B
          slave.confirmed := false.B
        }
      }
    }

    // The number of slaves that answer.
    is(count) {
      val now = Mux(answer.counter > maxSlaves.U, maxSlaves.U, answer.counter)
      counted  := now
      answered := answer.counter
      place    := Mux(now < here, now, here)
      part     := 0.U
      state    := Mux(now < here, lose, Mux(now > here, scan, pause))
    }
    is(lose) {
      search := place
      state  := losing
      when(place >= here) {
        here  := counted
        state := pause
      }
    }
    is(losing) {
      part := part ^ 1.U // the table takes a cycle to answer
      when(part(0)) {
        emitThen(lose, EventKind.Lost.U, place, stored.node)
        place := place + 1.U
      }
    }

    // What new slaves say of themselves.
    is(scan) {
      val position = 0.U(16.W) - place
      switch(part) {
        is(0.U) { ask(Bwr, 0.U, AliasEnable, 1, 1.U) } // from now on they answer to their node ID
        is(1.U) { ask(Bwr, 0.U, AlarmRegisters.Command, 1, AlarmRegisters.Repeat.U) }
        is(2.U) { ask(Aprd, position, 0x0012, 2) }
        is(3.U) { ask(Aprd, position, 0x0110, 2) }
        is(4.U) { ask(Aprd, position, AlarmRegisters.SelfTest, 2) }
      }
      askAlone(list)
    }
    is(list) {
      part  := part + 1.U
      state := scan
      switch(part) {
        is(2.U) { slave.node := answer.data(15, 0) }
        is(3.U) { status := answer.data(15, 0) }
        is(4.U) {
          val isAlarm = answer.counter === 1.U
          selfTest        := Mux(isAlarm, answer.data(7, 0), 0.U)
          slave.epoch     := answer.data(15, 8)
          slave.heard     := false.B
          slave.confirmed := true.B
          search          := place
          part            := 0.U
          state           := know
          // Its host is still starting: later, but not for ever.
          when(isAlarm && answer.data(7, 0) === 0.U && !patience.andR) {
            patience := patience + 1.U
            beat     := 0.U
            state    := pause
          }
        }
      }
      when(answer.counter === 0.U && (part === 2.U || part === 3.U)) { // gone again
        beat  := 0.U
        state := pause
      }
    }
    is(know) {
      part := 1.U
      when(part === 1.U) {
        val isSame = place < listed && stored.node === slave.node
        emitThen(equal, Mux(isSame, EventKind.Found.U, EventKind.Present.U), place, slave.node)
        event0.sequence := status
        event0.state    := selfTest
        event0.epoch    := slave.epoch
        table.io.write  := !isSame
        patience        := 0.U
        search          := 0.U
        when(place >= listed) { listed := place + 1.U }
      }
    }
    is(equal) { // to one before it; `stored` is the slave before `search`
      search := search + 1.U
      before := stored.node
      when(search =/= 0.U && search <= place && stored.node === slave.node) {
        hasTwin := true.B
        twin    := search - 1.U
      }
      when(search >= place) { state := gap }
    }
    is(gap) {
      state := next
      when(hasTwin) {
        hasTwin := false.B
        emitThen(gap, EventKind.Duplicate.U, place, slave.node)
        event0.sequence := twin
      }.elsewhen(place =/= 0.U && slave.node =/= before + 1.U) {
        emitThen(next, EventKind.Gap.U, place, slave.node)
        event0.sequence := before
      }
    }
    is(next) {
      here  := place + 1.U
      place := place + 1.U
      part  := FirstQuestion.U
      state := scan
      when(place + 1.U === counted) { emitThen(pause, EventKind.Scanned.U, counted, answered) }
    }

    is(emit) {
      when(event.ready) {
        state := behind
        when(event0.kind === EventKind.Detector.U) {
          val record = WireDefault(slave)
          record.event          := nextEvent
          table.io.write        := true.B
          table.io.writeAddress := event0.position
          table.io.writeData    := record.asUInt
        }
      }
    }
  }
}

object LineMaster {

  /** Answers looked at per frame. */
  private val Answers     = 32
  private val RecordBytes = 8

  /** The first thing that only one slave is asked for. */
  private val FirstQuestion = 2
  private val Aprd          = 1
  private val AliasEnable   = 0x0103
  private val Bwr           = 8
  private val Fpwr          = 5
}
