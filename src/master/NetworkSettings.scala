package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.memory.DualPortRam

/** The addresses of master and server, in block RAM as they stand in the headers of a UDP datagram to the
  * server; whoever makes or checks headers has a copy of its own to read from.
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

  /** Where things are: MAC addresses as bytes 0 to 11 of the header, the rest as its bytes 26 to 37. */
  val ServerMac  = 0
  val MasterMac  = 6
  val MasterIp   = 12
  val ServerIp   = 16
  val MasterPort = 20
  val ServerPort = 22
  val Bytes      = 24

  val AddressBits = 5
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

  /** To [[NetworkSettings]]. */
  val address = IO(Output(UInt(AddressBits.W)))

  private val at = RegInit(0.U(6.W)) // byte that comes next, up to 63; reset: a frame begins
  when(byte.valid) { at := Mux(first, 1.U, Mux(at.andR, at, at + 1.U)) }
  when(end.valid) { at := 0.U }

  /** Byte `n` of the frame is to be byte `m` of the settings. */
  private def shifted(n: Int, m: Int): UInt = (at + (64 + m - n).U)(AddressBits - 1, 0)
  address := MuxCase(
    shifted(38, MasterIp), // target of an ARP request
    Seq(
      (at < 6.U)  -> shifted(0, MasterMac),
      (at < 30.U) -> shifted(26, ServerIp),
      (at < 34.U) -> shifted(30, MasterIp),
      (at < 38.U) -> shifted(36, MasterPort)
    )
  )
}
