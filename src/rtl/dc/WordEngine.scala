package flyframe.dc

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.ram.{ConstantRom, DualPortRam}

/** A task of a [[WordEngine]]: where it begins in the program, and the index that its steps add to the
  * numbers of words.
  */
final case class Task(label: String, index: Int = 0)

/** Adds words of eight bytes in block RAM, a word per round of eight cycles: what distributed clocks have to
  * do with times, one after the other, by a [[Program]].
  *
  * There are two levels. A task in front begins with the round after it has been asked for and runs to its
  * end; in the rounds between those of such tasks a task in the background goes on.
  *
  * @param program
  *   what there is to do
  * @param front
  *   tasks in front, by priority
  * @param back
  *   tasks in the background, by priority
  * @param inputs
  *   how many numbers come from outside
  * @param constants
  *   numbers behind those
  * @param conditions
  *   how many conditions come from outside
  * @param commands
  *   how many commands go outside
  * @param lanes
  *   bytes of a word of the bus
  */
class WordEngine(
    program: Program,
    front: Seq[Task],
    back: Seq[Task],
    inputs: Int,
    constants: Seq[Int],
    conditions: Int,
    commands: Int,
    lanes: Int
) extends Module {
  import WordEngine._
  private val laneBits  = log2Ceil(lanes)
  private val pcBits    = log2Ceil(program.steps.size)
  private val inputBits = log2Ceil(inputs + constants.size) max 1

  /** See [[LocalClock]]; its rounds must have eight cycles. */
  val timeByte = IO(Input(UInt(8.W)))
  val place    = IO(Input(UInt(3.W)))

  /** Tasks that are asked for, until they are `taken`. */
  val ask       = IO(Input(Vec(front.size, Bool())))
  val taken     = IO(Output(Vec(front.size, Bool())))
  val backAsk   = IO(Input(Vec(back.size, Bool())))
  val backTaken = IO(Output(Vec(back.size, Bool())))

  /** Numbers and conditions from outside; they must not change while a step looks at them. */
  val input     = IO(Input(Vec(inputs, UInt(16.W))))
  val condition = IO(Input(Vec(conditions, Bool())))

  /** The counter becomes 16 less one of these by [[Command.Depth]]. */
  val depth = IO(Input(Vec(2, UInt(4.W))))

  /** The command of a step is due, and the lowest bytes of its result; of those for outside, from
    * [[Command.Outside]] on.
    */
  val command = IO(Output(Vec(commands, Bool())))
  val result  = IO(Output(UInt(16.W)))

  /** Bus or host write a word of the settings, by its place behind 0x0900. */
  val write        = IO(Input(Bool()))
  val writeAddress = IO(Input(UInt((8 - laneBits).W)))
  val writeMask    = IO(Input(UInt(lanes.W)))
  val writeData    = IO(Input(UInt((8 * lanes).W)))

  /** What is read at a place behind 0x0900, a cycle later: of the settings, and of the engine's word
    * `readWord`.
    */
  val readAddress = IO(Input(UInt((8 - laneBits).W)))
  val settingData = IO(Output(UInt((8 * lanes).W)))
  val readWord    = IO(Input(UInt(5.W)))
  val wordData    = IO(Output(UInt((8 * lanes).W)))

  private val last = place.andR

  // After a reset every word becomes 0.
  private val cleared = RegInit(0.U(6.W)) // reset: none yet
  private val clears  = !cleared(5)
  when(last && clears) { cleared := cleared + 1.U }

  // ---- the step of this round ----
  private val pc       = Reg(UInt(pcBits.W))
  private val index    = Reg(UInt(3.W))
  private val isFront  = RegInit(false.B) // reset: nothing to do
  private val isBack   = RegInit(false.B) // reset: nothing to do
  private val backRuns = RegInit(false.B) // reset: nothing to do
  private val backPc   = Reg(UInt(pcBits.W))

  // The memory of the program has the next step when the round begins.
  private val nextPc = Wire(UInt(pcBits.W))
  private val rom =
    ConstantRom("ClockProgram", program.steps.map(Code(program, _)), Code.Width)(clock)
  rom.address := Mux(last, nextPc, pc)
  private def part(field: Code.Field): UInt             = rom.data(field.low + field.bits - 1, field.low)
  private def is(field: Code.Field, values: Int*): Bool = values.map(part(field) === _.U).reduce(_ || _)
  private def number(field: Code.Field, indexed: Bool)  = part(field) | Mux(indexed, index, 0.U)
  private val isActive                                  = isFront || isBack
  private val isAdd                                     = is(Code.Kind, Code.Kinds.Add, Code.Kinds.Repeats)
  private val step                                      = Wire(new Control)
  step.first    := Mux(clears, Code.Firsts.Zero.U, part(Code.First))
  step.second   := Mux(clears, Code.Seconds.Zero.U, part(Code.Second))
  step.input    := part(Code.Other)(inputBits - 1, 0)
  step.subtract := !clears && part(Code.Subtract).asBool
  step.narrow   := !clears && part(Code.Narrow).asBool
  step.places := Mux(
    clears,
    (Places.All + Code.Stores).U,
    Mux(isActive && isAdd, part(Code.Places), 0.U)
  )
  step.to      := Mux(clears, cleared, number(Code.To, part(Code.ToIndexed).asBool))
  step.command := Mux(isActive && isAdd, part(Code.Command), 0.U)
  step.flags   := isActive && isAdd
  step.front   := isFront

  // ---- cycle i of the round: the memories are asked for byte i ----
  private val from   = part(Code.Up).asSInt +& place.zext // -4 to 11: the byte of the second operand
  private val firsts = DualPortRam(Words * 8, 8)(clock)
  private val others = DualPortRam(Words * 8, 8)(clock)
  private val other  = number(Code.Other, is(Code.Second, Code.Seconds.Indexed))
  firsts.io.readAddress := Cat(number(Code.Word, is(Code.First, Code.Firsts.Indexed)), place)
  others.io.readAddress := Cat(other, from(2, 0))

  // Settings are written and read in words of the bus, and here by byte.
  private val settings = (0 until lanes).map { lane =>
    val (here, outside) = (DualPortRam(Settings, 8)(clock), DualPortRam(Settings, 8)(clock))
    for (ram <- Seq(here, outside)) {
      ram.io.write        := write && writeMask(lane)
      ram.io.writeAddress := writeAddress
      ram.io.writeData    := Lanes.byte(writeData, lane)
    }
    here.io.readAddress    := Cat(other, from(2, 0)) >> laneBits
    outside.io.readAddress := readAddress
    (here.io.readData, outside.io.readData)
  }
  settingData := VecInit(settings.map(_._2)).asUInt

  // ---- a cycle later: they answer ----
  private val asked   = RegNext(step)
  private val there   = RegNext(from)
  private val behind  = there >= 8.S
  private val upper   = RegNext(place(2))
  private val sixteen = VecInit(input ++ constants.map(_.U(16.W)))(asked.input)
  private val setting =
    if (lanes == 1) settings.head._1 else VecInit(settings.map(_._1))(there(laneBits - 1, 0))
  private val sign   = Reg(Bool())
  private val ofWord = Mux(behind, Fill(8, sign), others.io.readData)
  private val second = MuxLookup(asked.second, 0.U(8.W))(
    Seq(
      Code.Seconds.Word.U    -> ofWord,
      Code.Seconds.Indexed.U -> ofWord,
      Code.Seconds.Setting.U -> Mux(behind, 0.U, setting),
      Code.Seconds.Half.U    -> Mux(upper, 0.U, setting),
      Code.Seconds.Input.U -> Mux(
        there === 0.S,
        sixteen(7, 0),
        Mux(there === 1.S, sixteen(15, 8), 0.U)
      )
    )
  )
  sign := second(7)

  // ---- one more: the sum, which is written ----
  private val now = RegNext(asked)
  private val at  = ShiftRegister(place, 2)
  private val a = RegNext(
    MuxLookup(asked.first, firsts.io.readData)(
      Seq(Code.Firsts.Zero.U -> 0.U, Code.Firsts.Time.U -> RegNext(timeByte))
    )
  )
  private val b      = RegNext(Mux(there < 0.S, 0.U, second) ^ Fill(8, asked.subtract))
  private val carry  = Reg(Bool())
  private val narrow = Reg(Bool())
  private val sum    = a +& b + Mux(at === 0.U, now.subtract, carry)
  private val byte   = Mux(now.narrow && at(2), Fill(8, narrow), sum(7, 0))
  carry := sum(8)
  when(!at(2)) { narrow := byte(7) }

  private val stores = MuxLookup(now.places, false.B)(
    Seq(
      Places.All   -> true.B,
      Places.Upper -> at(2),
      Places.Speed -> (at(2, 1) === 1.U),
      Places.Rest  -> (at =/= 0.U)
    ).map { case (places, stored) => (places + Code.Stores).U -> stored }
  )
  private val writeAt = Cat(now.to, at)
  for (ram <- Seq(firsts, others)) {
    ram.io.write        := stores
    ram.io.writeAddress := writeAt
    ram.io.writeData    := byte
  }
  wordData := VecInit((0 until lanes).map { lane =>
    val ram = DualPortRam(Words * 8 / lanes, 8)(clock)
    ram.io.write        := stores && (if (lanes == 1) true.B else writeAt(laneBits - 1, 0) === lane.U)
    ram.io.writeAddress := writeAt >> laneBits
    ram.io.writeData    := byte
    ram.io.readAddress  := Cat(readWord, readAddress(2 - laneBits, 0))
    ram.io.readData
  }).asUInt

  // ---- what a step leaves behind, from the third cycle of the next round on ----
  private val low    = Reg(UInt(16.W))
  private val far    = Reg(Bool())
  private val isDone = at.andR
  when(at === 0.U) { low := Cat(low(15, 8), byte) }
  when(at === 1.U) { low := Cat(byte, low(7, 0)) }
  result := low
  far    := (byte.orR && at(2, 1) =/= 0.U) || (far && at =/= 0.U)
  private val negative = RegInit(VecInit(false.B, false.B)) // in the background, in front; reset: any will do
  private val isFar    = RegInit(VecInit(false.B, false.B))
  when(isDone && now.flags) {
    negative(now.front.asUInt) := byte(7)
    isFar(now.front.asUInt)    := byte.orR || far
  }
  private val due = RegNext(Mux(isDone, now.command, Command.None.U), 0.U)
  for ((pulse, i) <- command.zipWithIndex) pulse := due === (Command.Outside + i).U

  // ---- the next round ----
  private val counter      = Reg(UInt(5.W)) // of the background
  private val repeats      = is(Code.Kind, Code.Kinds.Repeats)
  private val ends         = RegNext(is(Code.Kind, Code.Kinds.End))
  private val conditionsOf = Seq(true.B, negative(isFront.asUInt), isFar(isFront.asUInt)) ++ condition
  private val met =
    VecInit(conditionsOf)(part(Code.Condition)(log2Ceil(conditionsOf.size) - 1, 0))
  // What is decided in the last cycle is prepared in the one before.
  private val next = RegNext(
    Mux(
      is(Code.Kind, Code.Kinds.Branch) && met === part(Code.When).asBool,
      part(Code.Target)(pcBits - 1, 0),
      Mux(repeats && counter =/= 1.U, pc, pc + 1.U)
    )
  )
  private val asks     = RegNext(ask)
  private val backAsks = RegNext(backAsk)
  when(last && isBack && repeats) { counter := counter - 1.U }
  for (i <- 0 until 2) when(due === (Command.Depth + i).U) { counter := 16.U - depth(i) }
  when(due === Command.Four.U) { counter := 4.U }

  private val goesOn     = isFront && !ends
  private val backGoesOn = Mux(isBack, !ends, backRuns)
  private val begins     = last && !clears && !goesOn
  private val anyAsks    = asks.asUInt.orR
  private val backAsked  = backAsks.asUInt.orR
  taken     := VecInit(PriorityEncoderOH(asks).map(_ && begins))
  backTaken := VecInit(PriorityEncoderOH(backAsks).map(_ && begins && !backGoesOn))
  private def entry(tasks: Seq[Task], wanted: Seq[Bool]): UInt =
    PriorityMux(wanted, tasks.map(t => program(t.label).U(pcBits.W)))
  private val backNext = Mux(backGoesOn, Mux(isBack, next, backPc), entry(back, backAsks))
  nextPc := Mux(goesOn, next, Mux(anyAsks, entry(front, asks), backNext))
  when(last) { pc := nextPc }
  when(begins) {
    isFront  := anyAsks
    isBack   := !anyAsks && (backGoesOn || backAsked)
    backRuns := backGoesOn || backAsked
    backPc   := backNext
    when(anyAsks) { index := PriorityMux(asks, front.map(_.index.U(3.W))) }
  }

  /** The step in hardware, but for how it goes on. */
  private class Control extends Bundle {
    val first    = UInt(Code.First.bits.W)
    val second   = UInt(Code.Second.bits.W)
    val input    = UInt(inputBits.W)
    val subtract = Bool()
    val narrow   = Bool()
    val places   = UInt(Code.Places.bits.W)
    val to       = UInt(Code.To.bits.W)
    val command  = UInt(Code.Command.bits.W)
    val flags    = Bool()
    val front    = Bool()
  }
}

object WordEngine {

  /** Words of the engine, and bytes of the settings: 0x0900 to 0x09FF. */
  val Words    = 32
  val Settings = 256

  /** Conditions of a [[Branch]]; further ones come from outside. */
  object Condition {
    val Always = 0

    /** The result of the last [[Add]] on this level was negative; it was less than 0 or more than 65535. */
    val Negative = 1
    val Far      = 2
    val Outside  = 3
  }

  /** Commands of an [[Add]]; further ones go outside. */
  object Command {
    val None = 0

    /** And the next one: the counter becomes 16 less that depth. */
    val Depth = 1

    /** The counter becomes 4. */
    val Four    = 3
    val Outside = 4
  }
}
