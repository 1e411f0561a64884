package flyframe.memory

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.params.EscParams
import flyframe.ram.DualPortRam

/** The place of a word in [[EscRam]]: one of its two memories, and the number of the word there. */
class RamPlace(p: EscParams) extends Bundle {

  /** True: the word is in the process data RAM; false: in the one for user RAM and register RAM. */
  val process = Bool()
  val index   = UInt((log2Ceil(p.ramBytes max EscRam.localBytes(p)) - log2Ceil(p.lanes)).W)
}

/** All block RAM the bus and the host can reach: process data RAM, and a second one for user RAM (its first
  * 128 bytes) and register RAM (its upper half, 512 bytes). One write port, one read port that answers in the
  * next cycle.
  */
class EscRam(p: EscParams) extends Module {
  val readPlace  = IO(Input(new RamPlace(p)))
  val readData   = IO(Output(UInt((8 * p.lanes).W)))
  val writeMask  = IO(Input(UInt(p.lanes.W)))
  val writePlace = IO(Input(new RamPlace(p)))
  val writeData  = IO(Input(UInt((8 * p.lanes).W)))

  private def banks(bytes: Int, process: Boolean): UInt = VecInit((0 until p.lanes).map { lane =>
    val ram = DualPortRam(bytes / p.lanes, 8)(clock)
    ram.io.readAddress  := readPlace.index
    ram.io.write        := writeMask(lane) && writePlace.process === process.B
    ram.io.writeAddress := writePlace.index
    ram.io.writeData    := Lanes.byte(writeData, lane)
    ram.io.readData
  }).asUInt

  private val local = banks(EscRam.localBytes(p), process = false)
  readData := (if (p.ramBytes == 0) local
               else Mux(RegNext(readPlace.process), banks(p.ramBytes, process = true), local))
}

object EscRam {

  /** Size of the RAM for user RAM and, if there is one, register RAM. */
  def localBytes(p: EscParams): Int = if (p.hasRegisterRam) 1024 else 128

  /** Where the register RAM begins in it. */
  val RegisterStart = 512
}

/** [[flyframe.registers.RegisterRam.index]] as hardware. */
object RegisterPlace {
  import flyframe.registers.RegisterRam._

  /** Areas that are told by the upper bits of an address. */
  private val apart = Seq(Fmmus, SyncManagers)

  /** The byte at `address` in the register RAM, 9 bits. */
  def apply(address: UInt): UInt =
    apart.foldRight(placeIn(Others, address)) { (area, others) =>
      Mux(isIn(area, address), placeIn(area, address), others)
    }

  /** The address lies in the area. */
  def isIn(area: Area, address: UInt): Bool = address(11, area.bits) === (area.start >> area.bits).U

  /** The address lies in that of FMMUs or SyncManagers. */
  def isApart(address: UInt): Bool = apart.map(isIn(_, address)).reduce(_ || _)

  private def placeIn(area: Area, address: UInt): UInt =
    Cat((area.index >> area.bits).U((9 - area.bits).W), address(area.bits - 1, 0))
}
