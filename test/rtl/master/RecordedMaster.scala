package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.{MasterController, SignalPins}
import flyframe.host.HostOf
import flyframe.memory.HostPort
import flyframe.mii.MiiPins
import flyframe.params.EscParams

/** Keeps the last two frames a port has sent, so that nobody has to look at every nibble. */
class FrameRecorder extends Module {

  /** Once per nibble slot. */
  val step  = IO(Input(Bool()))
  val valid = IO(Input(Bool()))
  val data  = IO(Input(UInt(4.W)))
  val now   = IO(Input(UInt(40.W)))

  /** Frames that have ended. */
  val count = IO(Output(UInt(16.W)))

  /** Of the frame with the number `bank` modulo 2: when its first nibble came, how many there are, and
    * sixteen of them.
    */
  val bank    = IO(Input(Bool()))
  val word    = IO(Input(UInt(8.W)))
  val start   = IO(Output(UInt(40.W)))
  val length  = IO(Output(UInt(12.W)))
  val nibbles = IO(Output(UInt(64.W)))

  private val memory  = Mem(8192, UInt(4.W))
  private val ended   = RegInit(0.U(16.W))
  private val at      = RegInit(0.U(12.W))
  private val starts  = Reg(Vec(2, UInt(40.W)))
  private val lengths = Reg(Vec(2, UInt(12.W)))
  when(step && valid) {
    memory(Cat(ended(0), at)) := data
    at                        := at + 1.U
    when(at === 0.U) { starts(ended(0)) := now }
  }.elsewhen(step && at =/= 0.U) {
    lengths(ended(0)) := at
    ended             := ended + 1.U
    at                := 0.U
  }
  count   := ended
  start   := starts(bank)
  length  := lengths(bank)
  nibbles := Cat((15 to 0 by -1).map(i => memory(Cat(bank, word, i.U(4.W)))))
}

/** Sends a frame into a port from a memory, so that nobody has to drive every nibble. */
class FramePlayer extends Module {
  val now = IO(Input(UInt(40.W)))

  /** Takes nibbles `64 * word` and following, while no frame is being sent. */
  val load    = IO(Input(Bool()))
  val word    = IO(Input(UInt(6.W)))
  val nibbles = IO(Input(UInt(256.W)))

  /** Slot of the first nibble, and how many there are. */
  val start  = IO(Input(UInt(40.W)))
  val length = IO(Input(UInt(12.W)))
  val valid  = IO(Output(Bool()))
  val data   = IO(Output(UInt(4.W)))

  private val memory = Mem(64, UInt(256.W))
  when(load) { memory(word) := nibbles }
  private val at = now - start
  valid := now >= start && at < length
  data  := memory(at(11, 6)) >> Cat(at(5, 0), 0.U(2.W))
}

/** The whole master with players and recorders at its ports; two core clock cycles are a nibble slot. */
class RecordedMaster(p: EscParams) extends Module {
  require(p.cyclesPerNibble == 2)

  /** Restarts the master, not what is around it. */
  val restart = IO(Input(Bool()))
  val link    = IO(Input(Vec(2, Bool())))
  val host    = IO(new HostPort(p.lanes))
  val alarm   = IO(new SignalPins)

  /** When the sounder went on last. */
  val soundedAt = IO(Output(UInt(40.W)))

  /** Of the players. */
  val load       = IO(Input(Vec(2, Bool())))
  val playWord   = IO(Input(UInt(6.W)))
  val play       = IO(Input(UInt(256.W)))
  val playStart  = IO(Input(Vec(2, UInt(40.W))))
  val playLength = IO(Input(Vec(2, UInt(12.W))))

  /** Of the recorders. */
  val count   = IO(Output(UInt(32.W)))
  val port    = IO(Input(Bool()))
  val bank    = IO(Input(Bool()))
  val word    = IO(Input(UInt(8.W)))
  val start   = IO(Output(UInt(40.W)))
  val length  = IO(Output(UInt(12.W)))
  val nibbles = IO(Output(UInt(64.W)))

  private val dut = withReset((reset.asBool || restart).asAsyncReset)(Module(new MasterController(p)))
  private val now = RegInit(0.U(40.W))
  // The receivers sample in the middle of a slot. Reset: any phase.
  private val rxClock = RegInit(false.B)
  rxClock := !rxClock
  when(rxClock) { now := now + 1.U }
  dut.phy_clk_ref := false.B
  HostOf(p, dut.hostPins, host)
  dut.alarm <> alarm
  soundedAt := RegEnable(now, dut.alarm.sounder && !RegNext(dut.alarm.sounder))
  private val recorders = dut.phys.zipWithIndex.collect { case (mii: MiiPins, y) =>
    val player = Module(new FramePlayer)
    player.now     := now
    player.load    := load(y)
    player.word    := playWord
    player.nibbles := play
    player.start   := playStart(y)
    player.length  := playLength(y)
    val recorder = Module(new FrameRecorder)
    mii.rx_clk     := rxClock.asClock
    mii.rx_er      := false.B
    mii.rx_dv      := player.valid
    mii.rxd        := player.data
    mii.link       := link(y)
    recorder.step  := dut.mii_tx_tick
    recorder.valid := mii.tx_en
    recorder.data  := mii.txd
    recorder.now   := now
    recorder.bank  := bank
    recorder.word  := word
    recorder
  }
  count   := Cat(recorders.reverse.map(_.count))
  start   := Mux(port, recorders(1).start, recorders(0).start)
  length  := Mux(port, recorders(1).length, recorders(0).length)
  nibbles := Mux(port, recorders(1).nibbles, recorders(0).nibbles)
}
