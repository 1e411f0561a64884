package flyframe.fibre

import chisel3._
import chiseltest._
import chiseltest.formal._
import chiseltest.formal.backends.Engines
import org.scalatest.flatspec.AnyFlatSpec

/** Two nodes with equal settings, ports and controller, from a reset on. They hear the same at one port, and
  * anything at the other one. Times are as short and as long as the solver likes.
  *
  * @param secret
  *   the port at which they hear different levels
  */
abstract class SeparationProof(secret: Int) extends Module {
  private val drive   = IO(Input(Bool()))
  private val up      = IO(Input(Vec(2, Bool())))
  private val level   = IO(Input(Vec(2, Bool())))
  private val other   = IO(Input(Bool()))
  private val home    = IO(Input(Bool()))
  private val forced  = IO(Input(UInt(2.W)))
  private val address = IO(Input(UInt(7.W)))
  private val ticks   = IO(Input(new BitTicks))
  private val ms      = IO(Input(Bool()))

  protected val nodes = for (isOther <- Seq(false, true)) yield {
    val node = Module(new BusMode)
    node.drive                      := drive
    node.up                         := up
    node.level                      := level
    node.home                       := home
    node.forced                     := forced
    node.address                    := address
    node.ticks                      := ticks
    node.ms                         := ms
    node.rests                      := false.B
    if (isOther) node.level(secret) := other
    node
  }
  protected val mode: UInt = nodes.head.report.mode
  protected val isBoth     = mode === nodes.last.report.mode
  assert(mode =/= 0.U, "no mode")
}

/** Nothing of R2 reaches T1 in modes 2 and 3; T1 is recessive in mode 3. */
class ToPort1Proof extends SeparationProof(secret = 1) {
  when(isBoth && mode =/= 1.U) {
    assert(nodes.head.send(0) === nodes.last.send(0), "R2 reaches T1")
  }
  when(mode === 3.U) { assert(nodes.head.send(0), "T1 is dominant in mode 3") }
}

/** Nothing of R1 reaches T2 in modes 2 and 3; T2 is recessive in mode 2. */
class ToPort2Proof extends SeparationProof(secret = 0) {
  when(isBoth && mode =/= 1.U) {
    assert(nodes.head.send(1) === nodes.last.send(1), "R1 reaches T2")
  }
  when(mode === 2.U) { assert(nodes.head.send(1), "T2 is dominant in mode 2") }
}

class FibreFormal extends AnyFlatSpec with ChiselScalatestTester with Formal {
  private def prove(dut: => Module, cycles: Int): Unit = {
    assume(Engines.present, Engines.missing)
    verify(dut, Seq(BoundedCheck(cycles), Engines.boolector))
  }

  // Up, 13 eighths until a guard waits, and its closing, with ticks in each cycle.
  private val depth = 20

  "FR-20, FR-22" should "hold: nothing of R2 reaches T1 in modes 2 and 3" in prove(new ToPort1Proof, depth)

  "FR-20, FR-22" should "hold: nothing of R1 reaches T2 in modes 2 and 3, either" in prove(
    new ToPort2Proof,
    depth
  )
}
