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

  private val ram = DualPortRam(Count * 4, 32)(clock)
  private val got = ram.io.readData

  // The words of a source: the sequences, a bit for each of the last 32 in the place of its low bits; then
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
    val idle, place, names, map, judges, forgets, keepsMap, keepsNames, tells, wipesNames, wipesPlace = Value
  }
  private val step        = RegInit(Step.idle) // reset: nothing is to be done
  private val now         = RegInit(0.U(16.W)) // units
  private val sweeps      = RegInit(false.B)   // a source is to be looked at; reset: none
  private val swept       = RegInit(0.U(7.W))
  private val clears      = RegInit(true.B)    // nothing is known any more
  private val names       = Reg(new Names)
  private val seen        = Reg(UInt(32.W))
  private val at          = Reg(UInt(5.W))     // a sequence, by its low bits
  private val isNew       = Reg(Bool())        // it is to be delivered
  private val isForgotten = Reg(Bool())
  private val wiping      = Reg(Bool())        // a source is being forgotten by the sweep

  private val it      = frame.bits
  private val place   = got.asTypeOf(new Place)
  private val limit   = Mux(confirm(15, 8).andR, MostUnits.U, confirm)
  private val silent  = now - place.heard > limit
  private val isData  = it.kind === LinkKind.Data.U
  private val above   = it.sequence - names.newest                            // the newest one, or below it
  private val isAhead = above =/= 0.U && (!above(13) || above(12, 0) === 0.U) // by up to 8,192
  private val isNear  = above(13, 5) === 0.U                                  // above it, by less than 32
  private val isBelow = above === 0.U || (above(13, 5).andR && above(4, 0) =/= 0.U) // by less than 32
  private val bit     = UIntToOH(at)

  when(unit) {
    now    := now + 1.U
    sweeps := true.B
  }

  private val source = Mux(
    step === Step.idle && !frame.valid && asks.valid,
    asks.bits,
    Mux(wiping || (step === Step.idle && !frame.valid), swept, it.source)
  )
  private def word(n: Int) = source ## n.U(2.W)
  ram.io.readAddress  := word(2)
  ram.io.write        := false.B
  ram.io.writeAddress := word(1)
  ram.io.writeData    := names.asUInt
  done                := false.B
  told.valid          := step === Step.tells
  told.bits           := Mux(silent, 0.U, place.distances.asUInt)

  switch(step) {
    is(Step.idle) {
      wiping := false.B
      when(frame.valid) { step := Step.place }
        .elsewhen(asks.valid) { step := Step.tells }
        .elsewhen(sweeps) {
          wiping := true.B
          step   := Step.wipesPlace
        }
    }
    is(Step.tells) { step := Step.idle }
    is(Step.place) {
      ram.io.readAddress := word(1)
      val next = WireDefault(place)
      when(silent) { next.distances := VecInit(0.U, 0.U) }
      for (p <- 0 to 1) when(it.receivedBy === p.U && it.sentBy =/= p.U) { next.distances(p) := it.distance }
      next.heard          := now
      ram.io.write        := true.B
      ram.io.writeAddress := word(2)
      ram.io.writeData    := next.asUInt
      isForgotten         := silent // it is forgotten
      step                := Step.names
    }
    is(Step.names) {
      ram.io.readAddress := word(0)
      names              := got.asTypeOf(new Names)
      when(isForgotten) {
        names.hasLife     := false.B
        names.hasSequence := false.B
      }
      step := Step.map
    }
    is(Step.map) {
      seen  := got
      isNew := false.B
      at    := it.sequence(4, 0)
      step  := Step.judges
      when(!isData) {
        step := Step.keepsNames
        when(it.kind === LinkKind.Start.U && !(names.hasLife && names.life === it.sequence)) {
          names.hasLife     := true.B
          names.life        := it.sequence
          names.hasSequence := false.B
        }
      }
    }
    is(Step.judges) {
      names.hasSequence := true.B
      step              := Step.keepsMap
      when(!names.hasSequence || isAhead) {
        isNew        := true.B
        names.newest := it.sequence
        seen         := seen & Fill(32, names.hasSequence && isNear)
        // Those between the newest one and this have not come.
        when(names.hasSequence && isNear) {
          at   := names.newest(4, 0) + 1.U
          step := Step.forgets
        }
      }.elsewhen(isBelow && (seen & bit) === 0.U) { isNew := true.B }
    }
    is(Step.forgets) {
      seen := seen & ~bit
      when(at === it.sequence(4, 0)) { step := Step.keepsMap }.otherwise { at := at + 1.U }
    }
    is(Step.keepsMap) {
      ram.io.write        := true.B
      ram.io.writeAddress := word(0)
      ram.io.writeData    := seen | Mux(isNew, bit, 0.U)
      step                := Step.keepsNames
    }
    is(Step.keepsNames) {
      ram.io.write := true.B
      done         := true.B
      step         := Step.idle
    }
    // The sweep: a source that is silent is forgotten, before the time goes round.
    is(Step.wipesPlace) {
      sweeps              := false.B
      ram.io.write        := silent || clears
      ram.io.writeAddress := word(2)
      ram.io.writeData    := 0.U
      step                := Mux(silent || clears, Step.wipesNames, Step.idle)
      when(!silent && !clears) { swept := swept + 1.U }
    }
    is(Step.wipesNames) {
      ram.io.write     := true.B
      ram.io.writeData := 0.U
      swept            := swept + 1.U
      sweeps           := clears && !swept.andR // all, one behind the other
      clears           := clears && !swept.andR
      step             := Step.idle
    }
  }
  takes  := done && isData && isNew
  double := done && isData && !isNew

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

  /** Units of silence that can be told from none, when the time of 16 bits goes round meanwhile. */
  val MostUnits = 0xfeff
}
