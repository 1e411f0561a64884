package flyframe.dc

import chisel3._
import chisel3.util._
import flyframe.memory.BufferEvents
import flyframe.registers.{ClockRegisters, KeptRead}

/** The local times at which buffers of SyncManagers have changed (DC-42, B-111), 32 bits each.
  *
  * The local time comes a byte per cycle, in rounds; a time between them is that of the last whole round and
  * what has passed since. What the drift control adds meanwhile, a few ns, is not.
  *
  * @param round
  *   cycles of a round of the clock, 8 or 4
  */
class EventTimes(periodNs: Int, round: Int, lanes: Int) extends Module {

  /** See [[LocalClock]]. */
  val timeByte = IO(Input(UInt(8.W)))
  val place    = IO(Input(UInt(log2Ceil(round).W)))
  val last     = IO(Input(Bool()))

  /** A frame begins; its first nibble has waited so many cycles. */
  val begins = IO(Input(Bool()))
  val waited = IO(Input(UInt(4.W)))

  /** What happens to buffers. */
  val events = IO(Input(new BufferEvents))

  /** A word is read; `data` has it a cycle later, if it `isHere`. */
  val read   = IO(Input(new EventTimes.Read(lanes)))
  val isHere = IO(Output(Bool()))
  val data   = IO(Output(UInt((8 * lanes).W)))

  // The time at the beginning of the last whole round, and in this cycle.
  private val bytes = Reg(Vec(4, UInt(8.W)))
  private val whole = Reg(UInt(32.W))
  when(place < 4.U) { bytes(place(1, 0)) := timeByte }
  when(last) { whole := (if (round > 4) bytes.asUInt else timeByte ## VecInit(bytes.take(3)).asUInt) }
  private val since = VecInit((0 until round).map(i => ((round + i + 1) * periodNs).U(10.W)))
  private val now   = RegNext(whole + since(place))

  private val ofFrame                               = RegEnable(now - waited * periodNs.U, begins)
  private def kept(happens: Bool, time: UInt): UInt = RegEnable(time, 0.U(32.W), happens) // reset: none yet
  private val times = Seq(kept(events.byEcat, ofFrame), kept(events.begun, now), kept(events.byPdi, now))

  // A frame sees all as they were when it began, and the host a time as it was at its first byte. What ECAT
  // changes changes behind its frames.
  private val forEcat = times.head +: times.tail.map(RegEnable(_, begins))
  private val forHost = RegInit(0.U(32.W)) // reset: none yet
  private def chosen(from: Seq[UInt], place4: UInt): UInt =
    Mux(place4(1), Mux(place4(0), from(2), from(1)), from(0))
  private def place4(address: UInt): UInt = (address << log2Ceil(lanes))(11, 2)
  private val isFirst = read.hostAsks && EventTimes.isAt(place4(read.hostAddress)) &&
    (if (lanes == 4) true.B else !(read.hostAddress << log2Ceil(lanes))(1, log2Ceil(lanes)).orR)
  when(isFirst && !RegNext(isFirst, false.B)) { forHost := chosen(times, place4(read.hostAddress)) }

  private val address = RegNext(read.address)
  private val time    = Mux(RegNext(read.byHost), forHost, chosen(forEcat, place4(address)))
  isHere := RegNext(EventTimes.isAt(place4(read.address)))
  data := (if (lanes == 4) time
           else
             VecInit((0 until 4 / lanes).map(i => time(8 * lanes * (i + 1) - 1, 8 * lanes * i)))(
               address(1 - log2Ceil(lanes), 0)
             ))
}

object EventTimes {

  /** What is read of them: a word by frames or by the host, and what the host asks for. */
  class Read(lanes: Int) extends Bundle {
    private def bits = 12 - log2Ceil(lanes)
    val byHost       = Bool()
    val address      = UInt(bits.W)
    val hostAsks     = Bool()
    val hostAddress  = UInt(bits.W)
  }

  /** Four bytes with a fourth of this address are one of them. */
  private def isAt(place4: UInt): Bool =
    ClockRegisters.EventTimes.map(a => place4 === (a / 4).U).reduce(_ || _)
}
