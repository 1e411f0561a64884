package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.memory.DualPortRam

/** What the host has set, in block RAM at the addresses of its registers (see [[MasterHost]]); whoever needs
  * it byte by byte has a copy of its own to read from.
  *
  * @param readers
  *   how many read
  */
class NetworkSettings(readers: Int) extends Module {
  import NetworkSettings._

  /** A byte of the host. */
  val write        = IO(Input(Bool()))
  val writeAddress = IO(Input(UInt(AddressBits.W)))
  val writeData    = IO(Input(UInt(8.W)))

  /** The byte comes a cycle later. */
  val readAddress = IO(Input(Vec(readers, UInt(AddressBits.W))))
  val readData    = IO(Output(Vec(readers, UInt(8.W))))

  for (i <- 0 until readers) {
    val ram = DualPortRam(1 << AddressBits, 8)(clock)
    ram.io.write        := write
    ram.io.writeAddress := writeAddress
    ram.io.writeData    := writeData
    ram.io.readAddress  := readAddress(i)
    readData(i)         := ram.io.readData
  }
}

object NetworkSettings {

  /** All settings have addresses below 0x80: low bits of the address of their registers. */
  val AddressBits = 7

  /** Where the addresses of the network begin. */
  val Network = 0x10

  /** Where things are behind `Network`, as in the headers of a UDP datagram to the server: MAC addresses as
    * bytes 0 to 11 of the header, the rest as its bytes 26 to 37.
    */
  val ServerMac  = 0
  val MasterMac  = 6
  val MasterIp   = 12
  val ServerIp   = 16
  val MasterPort = 20
  val ServerPort = 22

  /** Bits of an address behind `Network`. */
  val NetworkBits = 5

  /** The address of a byte behind `Network`: the sum, which needs no adder. */
  def ofNetwork(address: UInt): UInt = Cat(address(4), !address(4), address(3, 0))
}

/** Which setting a byte of a frame from the plant network must have: of a UDP datagram of the server, or of
  * an ARP request.
  */
class ExpectedByte extends Module {
  import NetworkSettings._

  /** See [[EthernetReceiver]]. */
  val byte  = IO(Flipped(Valid(UInt(8.W))))
  val first = IO(Input(Bool()))
  val end   = IO(Flipped(Valid(Bool())))

  /** Which byte of the addresses of the network. */
  val address = IO(Output(UInt(NetworkBits.W)))

  private val at = RegInit(0.U(6.W)) // byte that comes next, up to 63; reset: a frame begins
  when(byte.valid) { at := Mux(first, 1.U, Mux(at.andR, at, at + 1.U)) }
  when(end.valid) { at := 0.U }

  /** From byte `n` of the frame to byte `m` of the settings. */
  private def from(n: Int, m: Int): UInt = (32 + m - n & 31).U(NetworkBits.W)
  address := (at + MuxCase(
    from(38, MasterIp), // target of an ARP request
    Seq(
      (at < 6.U)  -> from(0, MasterMac),
      (at < 30.U) -> from(26, ServerIp),
      (at < 34.U) -> from(30, MasterIp),
      (at < 38.U) -> from(36, MasterPort)
    )
  ))(NetworkBits - 1, 0)
}
