package flyframe.dc

import chisel3._
import chisel3.util._
import flyframe.memory.RegisterBus
import flyframe.params.EscParams

/** The engine of distributed clocks with its program, and the speed of the local clock that it sets. The
  * parts that have work for it ask by the names of tasks.
  */
private[dc] class ClockEngine(val p: EscParams, clock: LocalClock) {
  import ClockProgram.{Input, Is, Out}

  /** What is done when the host begins to read a word of [[ClockProgram.Shown]]. */
  val forHost: Seq[(Task, Int)] =
    if (p.isDigitalIo) Nil
    else
      (Task("hostTime") -> ClockProgram.Shown.Time) +:
        ClockProgram.shown(p).map(n => Task("hostCopy", n) -> n)

  private val front: Seq[Task] =
    Seq(Task("frame"), Task("frame", 1)) ++ forHost.map(_._1) ++
      (if (p.syncSignals > 0) Seq("fired1", "fired0", "start").map(Task(_)) else Nil) ++
      Option.when(p.hasEnhancedSync)(Task("prepare")) ++
      (0 until 2 * p.latchSignals).map(e => Task("latch", ClockProgram.Shown.Latch + e)) ++
      Option.when(p.syncSignals > 0)(Task("check"))
  private val back: Seq[Task] =
    (Seq("reset", "resetMean", "resetSpeed") ++ Option.when(p.hasDirectSpeed)("setSpeed") ++
      (if (p.hasTimeByPdi) Seq("sampleOfLatch") else Seq("sampleOf0", "sampleOf1"))).map(Task(_))

  val engine: WordEngine =
    Module(
      new WordEngine(ClockProgram(p), front, back, Input.Count, Input.Constants, Is.Count, Out.Count, p.lanes)
    )
      .suggestName("clockEngine")
  private val speed = Module(new SpeedControl).suggestName("speedControl")
  engine.condition.foreach(_ := false.B)
  engine.ask.foreach(_ := false.B)

  /** ns that this cycle of the local clock counts. */
  val passes: UInt = (p.clockPeriodNs.S(5.W) + speed.more).asUInt(3, 0)

  /** The host gets its copy of this word of [[ClockProgram.Shown]]. */
  val copied: Vec[Bool] = WireInit(VecInit(Seq.fill(8)(false.B)))

  /** Asks for a task until it is taken; the time that `age` cycles have passed since is told to it. True: it
    * is taken, and begins in the next cycle.
    */
  def ask(task: Task, when: Bool, age: UInt = 0.U): Bool = {
    val number = front.indexOf(task)
    require(number >= 0, s"task is $task but must be one of ${front.mkString(", ")}.")
    engine.ask(number)            := when
    ages :+= engine.taken(number) -> age
    engine.taken(number)
  }
  private var ages = Seq.empty[(Bool, UInt)]

  /** The same in the background. */
  def askBack(label: String, when: Bool): Bool = {
    val number = back.indexOf(Task(label))
    engine.backAsk(number) := when
    engine.backTaken(number)
  }

  /** A command of the program. */
  def command(number: Int): Bool = engine.command(number - WordEngine.Command.Outside)

  /** A condition of the program. */
  def is(number: Int, condition: Bool): Unit =
    engine.condition(number - WordEngine.Condition.Outside) := condition

  /** What a command gives. */
  def result: UInt = engine.result

  def connect(bus: RegisterBus): Unit = {
    engine.timeByte := clock.timeByte
    engine.place    := clock.place
    engine.depth(0) := bus.value("time_filter_depth")
    engine.depth(1) := bus.value("speed_filter_depth")
    speed.value     := engine.result(14, 0)
    speed.slew      := command(Out.Slew)
    speed.lose      := command(Out.Lose)
    speed.win       := command(Out.Win)
    speed.round     := clock.last
    clock.more      := speed.more

    val aged = ages.filter(_._2.isWidthKnown).filter(_._2.getWidth > 1)
    val age  = RegEnable(Mux1H(aged), VecInit(aged.map(_._1)).asUInt.orR)
    engine.input(Input.Age)        := RegNext(age * p.clockPeriodNs.U)
    engine.input(Input.SpeedStart) := bus.value("speed_counter_start")
    engine.input(Input.ToArm)      := (52 * p.clockPeriodNs).U

    // What is written to their registers, and zeros after a reset, while the clearing of the register RAM
    // passes all places of FMMUs.
    val write = bus.write
    val page  = write.bits.byteAddress(11, 8)
    engine.write        := write.valid && page === Mux(bus.clears, 0x6.U, 0x9.U)
    engine.writeAddress := write.bits.byteAddress(7, log2Ceil(p.lanes))
    engine.writeMask    := write.bits.mask
    engine.writeData    := write.bits.data
  }
}

private[dc] object ClockEngine {

  /** Core cycles that a task may wait: all tasks of [[ClockProgram]] at once, some of them twice, and the
    * host's between each two of them, take less than 200 rounds, and an edge waits 256 cycles before.
    */
  val AgeBits = 11
}
