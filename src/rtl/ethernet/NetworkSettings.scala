package flyframe.ethernet

import chisel3._
import chisel3.util._
import flyframe.ram.DualPortRam
import flyframe.registers.NetworkAddresses

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

  /** All settings have addresses below 0x100, those of their registers. */
  val AddressBits = 8

  /** Bits of an address behind that of the first address in the network. */
  val NetworkBits = 5

  /** The register's address of a byte of the addresses in the network. */
  def ofNetwork(address: UInt): UInt = {
    require( // the sum needs no adder only there
      NetworkAddresses.First == 0x10,
      f"NetworkAddresses.First is 0x${NetworkAddresses.First}%02x but must be 0x10."
    )
    Cat(address(4), !address(4), address(3, 0))
  }
}

/** Where in a frame from the plant network a byte stands, and whether it is the setting that belongs there:
  * in a UDP datagram of the server, or in an ARP request.
  */
class ExpectedByte extends Module {
  import NetworkAddresses._
  import NetworkSettings._

  /** See [[EthernetReceiver]]; a byte every second cycle at most. */
  val byte = IO(Flipped(Valid(UInt(8.W))))
  val end  = IO(Flipped(Valid(Bool())))

  /** Which byte of the addresses of the network, and what it is a cycle later. */
  val address = IO(Output(UInt(NetworkBits.W)))
  val setting = IO(Input(UInt(8.W)))

  /** The place of the byte at hand, from 0 on; from 48 on it stays. When the frame ends: how many came. */
  val at = IO(Output(UInt(6.W)))

  /** The byte at hand is the setting. */
  val same = IO(Output(Bool()))

  /** From the sixth byte to the end: the frame is to the master's MAC address. */
  val mine = IO(Output(Bool()))

  private val place = RegInit(0.U(6.W)) // reset: a frame begins
  private val ours  = RegInit(false.B)  // reset: no frame
  at   := place
  same := byte.bits === setting
  mine := ours
  when(byte.valid) {
    when(!place(5, 4).andR) { place := place + 1.U }
    when(place < 6.U) { ours := same && (ours || place === 0.U) }
  }
  when(end.valid) {
    place := 0.U
    ours  := false.B
  }

  // What leads from the place of a byte to that of the setting, modulo 32.
  private def shift(from: Int, to: Int): UInt = ((32 + to - from) % 32).U(NetworkBits.W)
  address := (place + MuxCase(
    shift(0, MasterMac), // and 38, target of an ARP request
    Seq(
      (place < 16.U) -> shift(0, MasterMac),
      (place < 30.U) -> shift(26, ServerIp),
      (place < 34.U) -> shift(30, MasterIp),
      (place < 38.U) -> shift(36, MasterPort)
    )
  ))(NetworkBits - 1, 0)
}
