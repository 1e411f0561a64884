package flyframe.mi

import chisel3._
import chisel3.util._
import chisel3.util.random.LFSR
import flyframe.model.PhyBus

/** PHYs on the management bus as they answer frames on its pins (IEEE 802.3, clause 22), in the clock of the
  * controller. Their registers are memory, which a test reads and writes, too; only the link, 1[2], stays low
  * for the controller until it has been read behind its end. What they drive changes behind MDC as early or
  * as late as real PHYs may do it, 300 ns, by turns at random.
  */
class Phys(coreClockMhz: Int) extends Module {
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
  private val gone      = RegInit(0.U(32.W)) // PHYs whose link was away since their register 1 has been read
  private val rises     = mdc && !RegNext(mdc, false.B)
  private val ones      = RegInit(0.U(6.W))
  private val seen      = RegInit(0.U(5.W))  // bits of the frame behind its preamble
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

  // What a read tells is taken at its begin.
  private val asked    = header(9, 5)
  private val isStatus = header(4, 0) === Phy.Status.U
  private val stored   = registers(header(9, 0))
  private val begins   = rises && seen === 14.U && isThere && reads
  private val told     = RegEnable(Mux(isStatus && gone(asked), stored & ~Phys.Link.U(16.W), stored), begins)
  private def only(phy: UInt, when: Bool) = Mux(when, UIntToOH(phy, 32), 0.U(32.W))
  private val ends                        = begins && isStatus && (stored & Phys.Link.U) =/= 0.U
  private val loses = store.valid && at(4, 0) === Phy.Status.U && (store.bits & Phys.Link.U) === 0.U
  gone := (gone & ~only(asked, ends)) | only(at(9, 5), loses)

  // It is driven two cycles behind MDC, or as late as is in time.
  private val most      = coreClockMhz * 300 / 1000 - 2
  private val left      = RegInit(0.U(log2Ceil(most + 1).W))
  private val isDriving = RegInit(false.B)
  private val bit       = Reg(Bool())
  when(rises) { left := Mux(LFSR(7, rises)(0), most.U, 0.U) }.elsewhen(left =/= 0.U) { left := left - 1.U }
  when(!rises && left === 0.U) {
    isDriving := isThere && reads && seen >= 15.U
    bit       := seen >= 16.U && told(15.U - seen(3, 0))
  }
  drives := isDriving
  level  := Mux(isDriving, bit, line)
  value  := registers(at)
  when(store.valid) { registers(at) := store.bits }
}

/** What registers of a PHY hold at power-on, and how tests name their addresses. */
object Phys {

  /** The bit of register 1 that tells a link. */
  val Link = 4

  /** Auto-negotiation on, and everything advertised, Gigabit included; a link to a partner like it. */
  val PowerOn: Map[Int, Int] = Map(0 -> 0x3100, 1 -> 0x796d, 4 -> 0x01e1, 5 -> 0x45e1, 9 -> 0x0300)
}

/** The PHYs of a bench, as a test reaches them. */
trait PhyRegisters {
  def get(phy: Int, register: Int): Int
  def set(phy: Int, register: Int, value: Int): Unit

  /** The link of the PHY goes and comes back before anybody looks. */
  def blink(phy: Int): Unit = {
    val status = get(phy, Phy.Status)
    set(phy, Phy.Status, status & ~Phys.Link)
    set(phy, Phy.Status, status)
  }

  /** The PHY does not answer, or does again. */
  def remove(phy: Int): Unit
  def insert(phy: Int): Unit
}

/** The same for the golden model. */
class ModelPhys(addresses: Seq[Int]) extends PhyBus with PhyRegisters {
  private val present = scala.collection.mutable.Set.from(addresses)
  private val gone    = scala.collection.mutable.Set.empty[Int] // links, since they were read last
  private val values =
    scala.collection.mutable.Map.from(for (a <- addresses; (r, v) <- Phys.PowerOn) yield (a, r) -> v)

  def read(phy: Int, register: Int): Option[Int] = Option.when(present(phy)) {
    val now = get(phy, register)
    if (register != Phy.Status || !gone(phy)) now
    else {
      if ((now & Phys.Link) != 0) gone -= phy
      now & ~Phys.Link
    }
  }
  def write(phy: Int, register: Int, value: Int): Unit = if (present(phy)) set(phy, register, value)
  def get(phy: Int, register: Int): Int                = values.getOrElse((phy, register), 0)
  def set(phy: Int, register: Int, value: Int): Unit = {
    values((phy, register)) = value
    if (register == Phy.Status && (value & Phys.Link) == 0) gone += phy
  }
  def remove(phy: Int): Unit = present -= phy
  def insert(phy: Int): Unit = present += phy
}
