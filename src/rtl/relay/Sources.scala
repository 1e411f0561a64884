package flyframe.relay

import chisel3._
import chisel3.util._
import flyframe.ram.DualPortRam

/** A frame of another node that came whole. */
class WholeFrame extends Bundle {
  val kind       = UInt(2.W)
  val sentBy     = UInt(1.W) // the port by which its source sent this copy
  val source     = UInt(7.W)
  val sequence   = UInt(14.W)
  val distance   = UInt(8.W)
  val receivedBy = UInt(1.W)
}

/** What a node knows of each source (FR-59 to FR-61), in block RAM: which sequences came, its life, its
  * distances, and when it was heard.
  */
class Sources extends Module {
  import Sources._

  /** Relay mode is on; `confirmUs` in units of 10 us; 640 us are over (RB-23). */
  val on      = IO(Input(Bool()))
  val confirm = IO(Input(UInt(16.W)))
  val unit    = IO(Input(Bool()))

  /** A frame, until it is `done`; then whether it is to be delivered, or came before. */
  val frame  = IO(Input(Valid(new WholeFrame)))
  val done   = IO(Output(Bool()))
  val takes  = IO(Output(Bool()))
  val double = IO(Output(Bool()))

  /** Asks for the distances of a source until they are told, that at port 1 in the low byte. */
  val asks = IO(Input(Valid(UInt(7.W))))
  val told = IO(Output(Valid(UInt(16.W))))

  // Of each source, the sequences that came, a bit for each of the last 32 in the place of its low bits; and
  // two words.
  private val map = DualPortRam(Count * Last, 1)(clock)
  private val ram = DualPortRam(Count * 2, 32)(clock)

  private class Names extends Bundle {
    val hasLife     = Bool()
    val life        = UInt(14.W)
    val hasSequence = Bool()
    val newest      = UInt(14.W)
  }
  private class Place extends Bundle {
    val distances = Vec(2, UInt(8.W))
    val heard     = UInt(16.W)
  }

  private object Step extends ChiselEnum {
    val idle, reads, comes, place, names, weighs, judges, marks, keeps, tells, looks, forgets = Value
  }
  private val step   = RegInit(Step.idle) // reset: nothing is to be done
  private val now    = RegInit(0.U(16.W)) // units
  private val sweeps = RegInit(false.B)   // a source is to be looked at; reset: none
  private val swept  = RegInit(0.U(7.W))
  private val clears = RegInit(true.B)    // nothing is known any more
  private val names  = Reg(new Names)
  private val at     = Reg(UInt(5.W))     // a sequence, by its low bits
  private val isNew  = Reg(Bool())        // it is to be delivered
  private val source = Reg(UInt(7.W))
  private val isOld  = Reg(Bool())        // a source is forgotten for itself, not for its frame
  private val isAsk  = Reg(Bool())

  private val it     = frame.bits
  private val place  = ram.io.readData.asTypeOf(new Place)
  private val limit  = RegNext(Mux(confirm(15, 8).andR, MostUnits.U, confirm)) // it rests
  private val silent = RegNext(now - place.heard) > limit
  private val low    = it.sequence(4, 0)
  private val above  = it.sequence - names.newest                              // the newest one, or below it

  // Weighed in a step of their own: above it by up to 8,192, or by less than 32; below it by less than 32.
  private val isAhead = RegNext(above =/= 0.U && (!above(13) || above(12, 0) === 0.U))
  private val isNear  = RegNext(above(13, 5) === 0.U)
  private val isBelow = RegNext(above === 0.U || (above(13, 5).andR && above(4, 0) =/= 0.U))

  when(unit) {
    now    := now + 1.U
    sweeps := true.B
  }

  // What is kept of a frame. The word was there in the step before, from which the way back has no time.
  private val distances = RegNext(place.distances)
  private val heard     = Wire(new Place)
  heard.heard     := now
  heard.distances := distances
  for (p <- 0 to 1) when(it.receivedBy === p.U && it.sentBy =/= p.U) { heard.distances(p) := it.distance }

  // What is read in a step is there in the next one: where a source stands first, twice, for its time.
  map.io.write        := step === Step.marks
  map.io.writeAddress := it.source ## at
  map.io.writeData    := at === low
  map.io.readAddress  := it.source ## low
  ram.io.readAddress  := source ## (step =/= Step.place)
  ram.io.write        := false.B
  ram.io.writeAddress := source ## (step === Step.place || step === Step.looks)
  ram.io.writeData    := Mux(step === Step.keeps, names.asUInt, heard.asUInt)
  done                := step === Step.keeps
  takes               := done && isNew
  double              := done && !isNew && it.kind === LinkKind.Data.U
  told.valid          := step === Step.tells
  told.bits           := Mux(silent || clears, 0.U, place.distances.asUInt) // what is not cleared is old

  switch(step) {
    is(Step.idle) {
      isOld  := !frame.valid
      isAsk  := !frame.valid && asks.valid
      source := Mux(frame.valid, it.source, Mux(asks.valid, asks.bits, swept))
      when(frame.valid || asks.valid || sweeps) { step := Step.reads }
    }
    is(Step.reads) { step := Step.comes }
    is(Step.comes) { step := Mux(isAsk, Step.tells, Mux(isOld, Step.looks, Step.place)) }
    is(Step.tells) { step := Step.idle }
    is(Step.place) {
      ram.io.write := !silent
      step         := Mux(silent, Step.looks, Step.names) // if it was silent it is a new one
    }
    is(Step.names) {
      names := ram.io.readData.asTypeOf(new Names)
      step  := Step.weighs
    }
    is(Step.weighs) { step := Step.judges }
    is(Step.judges) {
      isNew := false.B
      at    := low
      step  := Step.keeps
      when(it.kind === LinkKind.Start.U && !(names.hasLife && names.life === it.sequence)) {
        names.hasLife     := true.B
        names.life        := it.sequence
        names.hasSequence := false.B
      }
      when(it.kind === LinkKind.Data.U) {
        names.hasSequence := true.B
        when(!names.hasSequence || isAhead) {
          // Those between the newest one and this have not come; all 32 are anew if that lies farther away.
          isNew        := true.B
          names.newest := it.sequence
          at           := Mux(names.hasSequence && isNear, names.newest(4, 0), low) + 1.U
          step         := Step.marks
        }.elsewhen(isBelow && map.io.readData === 0.U) {
          isNew := true.B
          step  := Step.marks
        }
      }
    }
    is(Step.marks) {
      at := at + 1.U
      when(at === low) { step := Step.keeps }
    }
    is(Step.keeps) {
      ram.io.write := true.B
      step         := Step.idle
    }
    // A source that is silent is forgotten, by the sweep before the time goes round.
    is(Step.looks) {
      ram.io.write     := silent || clears || !isOld
      ram.io.writeData := now
      step             := Mux(silent || clears || !isOld, Step.forgets, Step.idle)
      when(isOld) {
        sweeps := false.B
        when(!silent && !clears) { swept := swept + 1.U }
      }
    }
    is(Step.forgets) {
      ram.io.write     := true.B
      ram.io.writeData := 0.U
      step             := Step.idle
      when(isOld) {
        swept  := swept + 1.U
        sweeps := clears && !swept.andR // all, one behind the other
        clears := clears && !swept.andR
      }
    }
  }

  // Before a frame can be whole, all are forgotten: that takes 2,500 cycles at least.
  when(!on) {
    step   := Step.idle
    clears := true.B
    sweeps := true.B
    swept  := 0.U
  }
}

object Sources {
  private val Count = 128
  private val Last  = 32 // sequences that are known of each

  /** Units of silence that can be told from none, when the time of 16 bits goes round meanwhile. */
  val MostUnits = 0xfeff
}
