package flyframe.mi

import chisel3._
import chisel3.util._
import flyframe.model.PhyBus

/** PHYs on the management bus as they answer frames on its pins (IEEE 802.3, clause 22), in the clock of the
  * controller. Their registers are plain memory, which a test reads and writes, too.
  */
class Phys extends Module {
  val mdc = IO(Input(Bool()))

  /** The line as the controller drives it, or as the pull-up has it; and what becomes of it. */
  val line  = IO(Input(Bool()))
  val level = IO(Output(Bool()))

  /** A PHY drives the line. */
  val drives = IO(Output(Bool()))

  /** Addresses at which there is one. */
  val present = IO(Input(UInt(32.W)))

  /** The test's access: address of PHY and register. */
  val at    = IO(Input(UInt(10.W)))
  val value = IO(Output(UInt(16.W)))
  val store = IO(Input(Valid(UInt(16.W))))

  private val registers = Mem(1024, UInt(16.W))
  private val rises     = mdc && !RegNext(mdc, false.B)
  private val ones      = RegInit(0.U(6.W))
  private val seen      = RegInit(0.U(5.W)) // bits of the frame behind its preamble
  private val shift     = Reg(UInt(32.W))
  private val now       = Cat(shift(30, 0), level)
  private val header    = Reg(UInt(14.W))
  private val reads     = header(11, 10) === 2.U
  private val isThere   = present(header(9, 5)) && header(13, 12) === 1.U

  when(rises) {
    shift := now
    when(seen === 0.U) {
      when(level) { ones := Mux(ones === 32.U, ones, ones + 1.U) }.otherwise {
        ones := 0.U
        when(ones === 32.U) { seen := 1.U }
      }
    }.otherwise {
      seen := seen + 1.U
      when(seen === 13.U) { header := now }
      when(seen === 31.U && isThere && header(11, 10) === 1.U && now(17, 16) === 2.U) {
        registers(header(9, 0)) := now(15, 0)
      }
    }
  }
  drives := isThere && reads && seen >= 15.U
  level  := Mux(drives, seen >= 16.U && registers(header(9, 0))(15.U - seen(3, 0)), line)
  value  := registers(at)
  when(store.valid) { registers(at) := store.bits }
}

/** What registers of a PHY hold at power-on, and how tests name their addresses. */
object Phys {

  /** Auto-negotiation on, and everything advertised, Gigabit included; a link to a partner like it. */
  val PowerOn: Map[Int, Int] = Map(0 -> 0x3100, 1 -> 0x796d, 4 -> 0x01e1, 5 -> 0x45e1, 9 -> 0x0300)
}

/** The PHYs of a bench, as a test reaches them. */
trait PhyRegisters {
  def get(phy: Int, register: Int): Int
  def set(phy: Int, register: Int, value: Int): Unit

  /** The PHY does not answer, or does again. */
  def remove(phy: Int): Unit
  def insert(phy: Int): Unit
}

/** The same for the golden model. */
class ModelPhys(addresses: Seq[Int]) extends PhyBus with PhyRegisters {
  private val present = scala.collection.mutable.Set.from(addresses)
  private val values =
    scala.collection.mutable.Map.from(for (a <- addresses; (r, v) <- Phys.PowerOn) yield (a, r) -> v)

  def read(phy: Int, register: Int): Option[Int]       = Option.when(present(phy))(get(phy, register))
  def write(phy: Int, register: Int, value: Int): Unit = if (present(phy)) set(phy, register, value)
  def get(phy: Int, register: Int): Int                = values.getOrElse((phy, register), 0)
  def set(phy: Int, register: Int, value: Int): Unit   = values((phy, register)) = value
  def remove(phy: Int): Unit                           = present -= phy
  def insert(phy: Int): Unit                           = present += phy
}
