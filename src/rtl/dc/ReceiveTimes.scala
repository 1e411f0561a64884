package flyframe.dc

import chisel3._
import chisel3.util._
import flyframe.ram.DualPortRam

/** Stamps the beginning of frames at the ports and at the processing unit, and keeps the times of a frame
  * that asks for it (DC-07, DC-08).
  *
  * Block RAM has two places for each source: what is kept, which is read, and what its last frame has
  * brought. To keep that, the two change roles. Times are written a byte per cycle while the clock gives
  * them; a source that waits for that counts the cycles since its frame has begun, which are then taken off.
  *
  * @param ports
  *   how many there are, 1 to 4; source number `ports` is the processing unit
  * @param periodNs
  *   of a core cycle, in ns
  * @param bytes
  *   of a time, 4 or 8; of those of ports the lowest 4 are kept
  * @param lanes
  *   bytes of a word that is read
  * @param means
  *   the time of a port other than 0 is that of port 0 and the mean way ([[MeanWays]], B-100); with 2 ports
  *   and more
  */
class ReceiveTimes(ports: Int, periodNs: Int, bytes: Int, lanes: Int, means: Boolean) extends Module {
  import ReceiveTimes._
  private val laneBits = log2Ceil(lanes)
  private val sources  = ports + 1

  /** See [[LocalClock]]. */
  val timeByte = IO(Input(UInt(8.W)))
  val place    = IO(Input(UInt(log2Ceil(bytes).W)))
  val last     = IO(Input(Bool()))

  /** A frame begins there, by source, and how many cycles ago it could be seen. */
  val begins = IO(Input(Vec(sources, Bool())))
  val waited = IO(Input(Vec(sources, UInt(4.W))))

  /** The times of the frame that is in the processing unit are to be kept, by source: of a port at once if it
    * has met a frame since, else with the next one that begins there (B-80).
    */
  val keep = IO(Input(Vec(sources, Bool())))

  /** No frame comes from there. */
  val absent = IO(Input(Vec(ports, Bool())))

  /** A word is read, by its place behind 0x0900; `data` has it a cycle later. */
  val readWord = IO(Input(UInt((5 - laneBits).W)))
  val data     = IO(Output(UInt((8 * lanes).W)))

  // Cycles that a source waits, and those that it takes to be seen here.
  private val delay   = if (means) 2 else 1
  private val longest = (sources + 1) * bytes + delay + 1 + 15
  private val ageBits = log2Ceil(longest + 1)
  private val waits   = RegInit(VecInit(Seq.fill(sources)(false.B))) // reset: no frame has begun
  private val ages = Seq.tabulate(sources) { i =>
    val age = Reg(UInt(ageBits.W)).suggestName(s"age_$i")
    age := Mux(begins(i), 2.U +& waited(i), age + 1.U)
    age
  }

  // One source per round is served.
  private val chosen   = RegInit(false.B) // reset: none
  private val choice   = Reg(UInt(log2Ceil(sources).W))
  private val age      = Reg(UInt(ageBits.W))
  private val next     = PriorityEncoder(waits)
  private val nextAge  = PriorityMux(waits, ages)
  private val isServed = PriorityEncoderOH(waits.asUInt)
  when(last) {
    chosen := waits.asUInt.orR
    choice := next
    age    := nextAge
  }
  for (i <- 0 until sources) {
    when(last && isServed(i)) { waits(i) := false.B }
    when(begins(i)) { waits(i) := true.B }
  }

  // Its time is that of the round less the age, and less what the frame was longer on its way than the mean.
  private def late: UInt = {
    val ways = Module(new MeanWays(ports, ageBits))
    ways.first  := begins(0)
    ways.waited := waited(0)
    ways.takes  := last
    ways.port   := next
    ways.age    := nextAge
    ways.comes  := chosen && place === 0.U
    ways.absent := absent
    val cycles = (age ## 0.U(MeanWays.LatePartBits.W)).zext +& ways.late
    RegEnable(((cycles * periodNs.S) >> MeanWays.LatePartBits).pad(16).asUInt, RegNext(ways.comes))
  }
  private def delayed[T <: Data](signal: T): T = ShiftRegister(signal, delay)
  private val since                            = if (means) late else RegNext(age * periodNs.U).pad(16)
  private val serves                           = ShiftRegister(chosen, delay, false.B, true.B) // reset: none
  private val source                           = delayed(choice)
  private val at                               = delayed(place)
  private val isEpu                            = source === ports.U
  private val written                          = serves && delayed(last)
  private val above                            = if (means) Fill(8, since(15)) else 0.U
  private val taken  = Mux(at === 0.U, since(7, 0), Mux(at === 1.U, since(15, 8), above))
  private val borrow = Reg(Bool())
  private val less   = (delayed(timeByte) -& taken) - Mux(at === 0.U, 0.U, borrow)
  borrow := less(8)

  // Whose place is kept, whether there is anything, what is new, and what is to be kept when it comes.
  private val kept  = Reg(Vec(sources, Bool()))                    // no reset: either place will do
  private val valid = RegInit(VecInit(Seq.fill(sources)(false.B))) // reset: nothing has been kept
  private val fresh = RegInit(VecInit(Seq.fill(sources)(false.B))) // reset: no frame has begun
  private val due   = RegInit(VecInit(Seq.fill(sources)(false.B))) // reset: nobody has asked
  for (i <- 0 until sources) {
    val isWritten = serves && source === i.U
    val changes   = due(i) && fresh(i) && !isWritten
    when(keep(i)) { due(i) := true.B }
    if (i < ports) when(absent(i)) { due(i) := false.B }
    when(begins(ports)) { fresh(i) := false.B } // what has been met before is of other frames
    when(changes) {
      kept(i)  := !kept(i)
      valid(i) := true.B
      fresh(i) := false.B
      due(i)   := false.B
    }
    when(written && source === i.U) { fresh(i) := true.B }
  }

  // The memories, one per lane, as the bytes stand behind 0x0900, twice.
  private val spare  = !kept(source)
  private val offset = Mux(isEpu, Processing.U, source << 2).pad(5) | at
  private val writes = serves && (isEpu || at < 4.U)
  private val place4 = readWord >> (2 - laneBits) // four bytes have one source
  private def ofReader(of: Vec[Bool]): Bool =
    Mux(
      place4 >= (Processing / 4).U,
      of(ports),
      VecInit((0 until 4).map(i => if (i < ports) of(i) else false.B))(place4(1, 0))
    )
  private val isBuilt = place4 < ports.U || place4 >= (Processing / 4).U
  private val shown   = RegNext(isBuilt && ofReader(valid))
  data := VecInit((0 until lanes).map { lane =>
    val ram = DualPortRam(Words, 8)(clock)
    ram.io.write        := writes && (if (lanes == 1) true.B else offset(laneBits - 1, 0) === lane.U)
    ram.io.writeAddress := Cat(spare, offset(4, 0)) >> laneBits
    ram.io.writeData    := less(7, 0)
    ram.io.readAddress  := Cat(ofReader(kept), readWord)
    Mux(shown, ram.io.readData, 0.U)
  }).asUInt
}

object ReceiveTimes {

  /** Words of a memory, at least so many that it goes to block RAM. */
  private val Words = 64

  /** Where the time of the processing unit stands behind 0x0900. */
  private val Processing = 0x18
}
