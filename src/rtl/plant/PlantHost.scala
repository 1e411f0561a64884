package flyframe.plant

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.memory.HostPort
import flyframe.ram.DualPortRam
import flyframe.registers.PlantRegisters

/** What is counted at the plant port, a pulse each. */
class PlantCounts extends Bundle {
  val badFrames = Bool()
  val refused   = Bool()
  val dropped   = Bool()
}

/** The registers of the plant port (see [[PlantRegisters]]), and the payload of the datagram that is to be
  * sent. An access takes two cycles, one to addresses in the network four more: they stand in a memory of
  * bytes.
  */
class PlantHost extends Module {
  import PlantRegisters._

  val host = IO(new HostPort(4))

  val run     = IO(Output(Bool()))
  val link    = IO(Input(Bool()))
  val sending = IO(Input(Bool()))
  val counts  = IO(Input(new PlantCounts))

  /** To the sender: pulse, length, and a byte of the payload a cycle after its address. */
  val send           = IO(Output(Bool()))
  val sendLength     = IO(Output(UInt(11.W)))
  val payloadAddress = IO(Input(UInt(11.W)))
  val payload        = IO(Output(UInt(8.W)))

  /** The oldest datagram received; a word of it a cycle after its address. */
  val waiting     = IO(Input(Bool()))
  val length      = IO(Input(UInt(11.W)))
  val release     = IO(Output(Bool()))
  val readAddress = IO(Output(UInt(DatagramStore.WordBits.W)))
  val readData    = IO(Input(UInt(32.W)))

  /** A byte of the settings; it comes a cycle after its address. */
  val settingWrite   = IO(Output(Bool()))
  val settingAddress = IO(Output(UInt(8.W)))
  val settingData    = IO(Output(UInt(8.W)))
  val setting        = IO(Input(UInt(8.W)))

  private val isSending   = host.addr(15, 11) === (SendData >> 11).U
  private val isReceived  = host.addr(15, 11) === (ReceivedData >> 11).U
  private val isRegisters = !isSending && !isReceived
  private val low         = host.addr(7, 0)
  // From 0x10 to 0x27.
  private val isSetting = isRegisters && low(7, 6) === 0.U && (low(5) ^ low(4)) && !(low(5) && low(3))
  private def isAt(register: Int) = isRegisters && low(7, 2) === ((register & 0xff) / 4).U

  // Reset: no access is under way.
  private val acknowledged = RegInit(false.B)
  private val step   = RegInit(0.U(3.W)) // the byte of the settings, and a step for the last one to come
  private val kept   = Reg(UInt(32.W))
  private val isRead = !isSetting || step(2)
  acknowledged   := host.req && !acknowledged && isRead
  step           := Mux(host.req && !acknowledged && !isRead, step + 1.U, 0.U)
  kept           := setting ## kept(31, 8)
  settingAddress := low(7, 2) ## step(1, 0)
  settingWrite   := host.req && !acknowledged && !isRead && host.write && host.be(step(1, 0))
  settingData    := Lanes.bytes(host.wdata, 4)(step(1, 0))

  private val writes                       = acknowledged && host.write
  private def written(register: Int): Bool = writes && isAt(register) && host.be(register % 4)

  // Reset: as the register table says.
  private val runs  = RegInit(false.B)
  private val size  = RegInit(0.U(11.W))
  private val wrote = Lanes.bytes(host.wdata, 4)
  when(written(Control)) { runs := wrote(Control % 4)(0) }
  when(written(SendLength)) { size := size(10, 8) ## wrote(SendLength % 4) }
  when(written(SendLength + 1)) {
    size := wrote(SendLength % 4 + 1)(2, 0) ## Mux(host.be(SendLength % 4), wrote(SendLength % 4), size(7, 0))
  }
  private def commands(bit: Int) = written(Command) && wrote(Command % 4)(bit)
  run        := runs
  send       := commands(Send)
  sendLength := size
  release    := commands(Release)

  private def counter(pulse: Bool): UInt = {
    val count = RegInit(0.U(8.W))
    when(commands(Clear)) { count := 0.U }.elsewhen(pulse && !count.andR) { count := count + 1.U }
    count
  }
  private val counters = Seq(counts.badFrames, counts.refused, counts.dropped).map(counter)

  private val rams = Seq.tabulate(4) { i =>
    val ram = DualPortRam(DataBytes / 4, 8)(clock)
    ram.io.write        := host.req && host.write && isSending && host.be(i)
    ram.io.writeAddress := host.addr(10, 2)
    ram.io.writeData    := wrote(i)
    ram.io.readAddress  := payloadAddress(10, 2)
    ram
  }
  payload     := VecInit(rams.map(_.io.readData))(RegNext(payloadAddress(1, 0)))
  readAddress := host.addr(10, 2)

  private val status = waiting ## sending ## link
  private val shown = RegNext(
    Mux1H(
      Seq(
        isAt(Control)    -> (status ## 0.U(7.W) ## runs),
        isAt(SendLength) -> (Mux(waiting, length, 0.U).pad(16) ## size.pad(16)),
        isAt(BadFrames)  -> Cat(counters.reverse)
      )
    )
  )
  require(
    Status == Control + 1 && ReceivedLength == SendLength + 2,
    "places of the registers of the plant port"
  )
  host.ack := acknowledged
  host.rdata := Mux(
    acknowledged,
    Mux(isReceived, readData & Fill(32, waiting), Mux(isSetting, kept, shown)),
    0.U
  )
}
