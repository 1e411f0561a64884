package flyframe.master

import chisel3._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import flyframe.Tier
import org.scalatest.flatspec.AnyFlatSpec

/** A scheduler with a line that answers or does not, within a few cycles, and units that take a few cycles
  * for what they read and write: that is all it may wait for. Whatever reporter, server and host do comes in
  * by the other inputs, which are free. The next cycle is always due.
  *
  * @param linePorts
  *   ends of the line
  * @param most
  *   core cycles within which a frame begins
  */
class BeginsProof(linePorts: Int, most: Int) extends Module {
  import BeginsProof._
  private val step    = IO(Input(Bool()))
  private val request = IO(Input(Bool()))
  private val offers  = IO(Input(Bool()))
  private val seeks   = IO(Input(Bool()))
  private val due     = IO(Input(Bool()))
  private val noting  = IO(Input(Bool()))
  private val writing = IO(Input(Bool()))
  private val sending = IO(Input(Bool()))
  private val done    = IO(Input(Bool()))
  private val good    = IO(Input(Bool()))
  private val busy    = IO(Input(Bool()))
  private val count   = IO(Input(UInt((LineExchange.NumberBits + 1).W)))
  private val answer  = IO(Input(UInt(8.W)))
  private val closed  = IO(Input(Bool()))
  private val changed = IO(Input(Bool()))
  private val dut     = Module(new Scheduler(2, Datagrams, linePorts))

  // Never two cycles in a row.
  private def brief(is: Bool): Unit = assume(!(is && RegNext(is, false.B)))
  Seq(seeks, writing, sending, busy, noting).foreach(brief)

  // A survey and a confirmation are always there. One slave is read in a frame, and one gets an order.
  assume(offers || !(dut.kind === DatagramKind.survey || dut.kind === DatagramKind.confirm))
  private val given = RegInit(false.B) // reset: none
  private val stage = RegNext(dut.kind)
  when(dut.kind =/= stage) { given := false.B }.elsewhen(dut.taken) { given := true.B }
  private val few = dut.kind === DatagramKind.read || dut.kind === DatagramKind.order
  assume(!(offers && few && (given || dut.taken) && dut.kind === stage))

  // An exchange ends some time after its beginning, and only then.
  private val flies = RegInit(false.B) // reset: no frame
  private val age   = RegInit(0.U(2.W))
  assume(done === (flies && (age === 2.U || good)))
  when(dut.go) {
    flies := true.B
    age   := 0.U
  }.elsewhen(flies) {
    age := age + 1.U
    when(done) { flies := false.B }
  }
  assume(count <= Answers.U && RegNext(count) === count)

  dut.step          := step
  dut.run           := true.B
  dut.cycle         := 0.U
  dut.ordersDue     := due
  dut.noting        := noting
  dut.offers        := offers
  dut.seeks         := seeks
  dut.writing       := writing
  dut.sending       := sending
  dut.done.valid    := done
  dut.done.bits     := good
  dut.count         := count
  dut.answer        := answer
  dut.unitPlace     := 0.U
  dut.busy          := busy
  dut.closed        := closed
  dut.changed       := changed
  dut.request.valid := request

  private val since = RegInit(0.U(8.W)) // cycles since a frame has begun; reset: as if it had
  since := Mux(dut.begins, 0.U, since + 1.U)
  assert(since < most.U, "no frame has begun")
}

object BeginsProof {

  /** Datagrams of a frame and answers: so few keep the proof short. */
  val Datagrams = 6
  val Answers   = 2
}

class SchedulerFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  private def prove(dut: => Module, steps: Int): Unit = {
    assume(Engines.present, Engines.missing)
    verify(dut, Seq(BoundedCheck(steps), Engines.boolector))
  }
  // From the reset a frame and a part of the next one; in the soak two frames.
  private val tier = Tier("proof that frames begin", "steps", test = 110, soak = 170)

  "LM-02" should "hold: frames begin, whatever reporter, server and host do" in
    tier.run("all", tier.size)(prove(new BeginsProof(1, 80), tier.size.toInt))

  // It takes as long as all other proofs of the master.
  if (Tier.isSoak)
    it should "hold for both ends of a ring" in
      tier.run("both ends of a ring", 150)(prove(new BeginsProof(2, 140), 150))
}
