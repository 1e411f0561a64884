package flyframe.fibre

import chisel3._
import flyframe.clocks.{EdgeSampleCrossing, LevelCrossing}
import flyframe.params.FibreParams

/** What all ports of a node count time by: each ends with the cycle in which it is true. */
class PortClock extends Bundle {
  val slow    = Bool() // 16 samples
  val window  = Bool() // 64 us: a window of noise
  val eight   = Bool() // us
  val ms      = Bool()
  val quarter = Bool() // of a second
  val odd     = Bool() // the microsecond since reset is an odd one
}

/** What a port tells of itself. */
class PortReport extends Bundle {
  val signal = Bool()
  val search = Bool()
  val up     = Bool()

  /** The level heard, 1 is recessive. */
  val level = Bool()

  /** It goes down; noise begins: one cycle each. */
  val loses = Bool()
  val noise = Bool()
}

/** A port from pin to pin: what it hears, whether it is up, and what it sends (FR-10 to FR-14, FB-16). */
class OpticalPort(p: FibreParams) extends Module {

  /** Pins: light received and sent; and whether the optical module has signal. */
  val rx      = IO(Input(Bool()))
  val tx      = IO(Output(Bool()))
  val optical = IO(Input(Bool()))

  val time = IO(Input(new PortClock))
  val off  = IO(Input(Bool()))
  val upMs = IO(Input(UInt(8.W)))

  /** The level to be sent while the port is up. */
  val send = IO(Input(Bool()))

  val report = IO(Output(new PortReport))

  private val crossing    = Module(new EdgeSampleCrossing(p.samplesPerCycle))
  private val demodulator = Module(Demodulator(p))
  private val detector    = Module(new SignalDetector(p))
  private val state       = Module(new PortState)
  private val modulator   = Module(new Modulator(p))

  crossing.in         := rx
  demodulator.samples := crossing.out
  demodulator.odd     := time.odd
  detector.samples    := crossing.out
  detector.windowEnds := time.window
  detector.slow       := time.slow

  private val signal = detector.signal && LevelCrossing(optical)
  private val search = detector.search && signal
  state.good    := signal && !search && !off
  state.off     := off
  state.upMs    := upMs
  state.eight   := time.eight
  state.ms      := time.ms
  state.quarter := time.quarter

  // A cycle later, as the way from the signal to the light is long. Reset: there is none.
  private val searches = RegNext(!signal || state.tells, true.B)
  modulator.tone := Mux(
    off,
    ToneCode.Dark,
    Mux(
      searches,
      ToneCode.Search,
      Mux(state.up && !send, ToneCode.Dominant, ToneCode.Recessive)
    )
  )
  tx := modulator.light

  report.signal := signal
  report.search := search
  report.up     := state.up
  report.level  := demodulator.level
  report.loses  := state.loses
  report.noise  := detector.noise
}
