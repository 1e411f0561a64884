package flyframe.alarm

import chisel3._
import chisel3.util._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.DetectorState
import flyframe.ram.DualPortRamIO

/** A RAM from which anything may come, but not the highest number, behind which the queue counts on. */
class AnyRam(depth: Int, width: Int) extends Module {
  val io               = IO(new DualPortRamIO(depth, width))
  private val anything = Wire(UInt((width - 1).W))
  anything    := DontCare
  io.readData := anything
}

/** Whatever the records are, even damaged ones, whatever the master orders and the appender does: an alarm
  * that lasts is written to the queue soon, if that is full, too. Two places stand for all.
  */
class AlarmProof extends Module {
  private val state              = IO(Input(UInt(DetectorState.Width.W)))
  private val test               = IO(Input(Bool()))
  private val acknowledge        = IO(Flipped(Valid(new RecordAck)))
  private val acknowledgeChanges = IO(Input(Bool()))
  private val confirm            = IO(Flipped(Valid(UInt(16.W))))
  private val confirmChanges     = IO(Input(Bool()))
  private val newMaster          = IO(Input(Bool()))
  private val busy               = IO(Input(Bool()))
  private val forget             = IO(Input(Bool()))
  private val dut                = Module(new AlarmQueue(depth = 2, newRam))
  private def newRam(depth: Int, width: Int, clock: Clock): DualPortRamIO = {
    val ram = Module(new AnyRam(depth, width))
    ram.io.clock := clock
    ram.io
  }
  dut.state              := state
  dut.test               := test
  dut.epoch              := 0x5a.U
  dut.forget             := forget || state === DetectorState.Off.U
  dut.time               := 0.U
  dut.wraps              := false.B
  dut.acknowledge        := acknowledge
  dut.acknowledgeChanges := acknowledgeChanges
  dut.confirm            := confirm
  dut.confirmChanges     := confirmChanges
  dut.newMaster          := newMaster
  dut.busy               := busy
  dut.read               := false.B // it only takes time
  dut.readWord           := 0.U
  assume(state <= DetectorState.Short.U)

  // An alarm that is not that of the last record. `hold` is true in the first two cycles of writing, which is
  // decided on a cycle before.
  private val isAlarm = state === DetectorState.Alarm.U && !test
  private val lasts   = RegInit(0.U(8.W))                            // cycles; reset: none
  private val taken   = RegInit(false.B)                             // reset: not
  private val isNews  = RegNext(dut.forget, true.B) || lasts =/= 0.U // reset: nothing was recorded
  lasts := Mux(isAlarm && !dut.forget && isNews, lasts + 1.U, 0.U)
  taken := isAlarm && !dut.forget && (taken || (dut.hold && lasts > 1.U))
  assert(taken || lasts < AlarmProof.Most.U, "an alarm is not taken")
}

object AlarmProof {

  /** Cycles of: a pass of another kind, one for an order that waits, the removal of a record, each for two
    * records; before each of them a carry and a copy; and the writing.
    */
  val Most = 3 * (1 + 2 * 8 + 1) + 3 * (1 + 8 + 1) + 4
}

class AlarmQueueFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  "ALARM-05" should "hold: an alarm always finds a place" in {
    assume(Engines.present, Engines.missing)
    verify(new AlarmProof, Seq(BoundedCheck(AlarmQueueFormal.Steps), Engines.boolector))
  }
}

object AlarmQueueFormal {

  /** The start of the queue, two records, each with a carry and a copy, and an alarm for as long as it may
    * take.
    */
  private val Steps = 2 * 10 + 2 * (9 + 10) + 10 + AlarmProof.Most + 10
}
