package flyframe.dc

import chisel3._
import chisel3.util._
import flyframe.memory.RegisterBus
import flyframe.registers.{ClockRegisters, KeptRead}

/** The system time: what frames and host read of it, and the comparison with that of the reference clock
  * (DC-16 to DC-23).
  *
  * @param waited
  *   cycles that the first nibble of a frame has waited when the frame begins
  * @param read
  *   the reader of what is kept
  * @param receiveTimes
  *   what it reads of those
  */
private[dc] class SystemTime(clocks: ClockEngine, waited: UInt, read: KeptRead, receiveTimes: UInt) {
  import ClockProgram.{Shown, Word}
  private val p        = clocks.p
  private val laneBits = log2Ceil(p.lanes)

  def connect(bus: RegisterBus): Unit = {
    // A frame begins: its time is asked for. Every other frame has another word for it, as the one before may
    // still have to be compared.
    val odd   = RegInit(false.B) // reset: any will do
    val waits = RegInit(false.B) // reset: no frame has begun
    val age   = Reg(UInt(ClockEngine.AgeBits.W))
    age := Mux(bus.frame.begins, 2.U +& waited, age + 1.U)
    for (n <- 0 to 1)
      when(clocks.ask(Task("frame", n), waits && odd === (n == 1).B, age)) { waits := false.B }
    // What is taken in the cycle behind that was asked for by the frame before.
    when(bus.frame.begins || RegNext(bus.frame.begins, false.B)) {
      waits := true.B
    }
    when(bus.frame.begins) { odd := !odd }

    // The time of the reference clock has come, and is compared when all writes have taken effect: from the
    // host, or with a frame.
    val received = RegInit(false.B) // reset: nothing
    if (p.hasTimeByPdi) {
      when(clocks.askBack("sampleOfLatch", received && !bus.writesPending)) { received := false.B }
      when(bus.completes("system_time")) { received := true.B }
    } else {
      val commits = RegEnable(odd, bus.commits)
      val ofOdd   = Reg(Bool())
      for (n <- 0 to 1)
        when(clocks.askBack(s"sampleOf$n", received && !bus.writesPending && ofOdd === (n == 1).B)) {
          received := false.B
        }
      when(bus.begins("system_time")) {
        received := true.B
        ofOdd    := commits
      }
    }
    if (p.hasDirectSpeed) {
      val due = RegInit(false.B).suggestName("directDue") // reset: it is off
      when(clocks.askBack("setSpeed", due && !bus.writesPending)) { due := false.B }
      when(bus.writes("speed_counter_direct")) { due := true.B }
    }
    val resets = Seq(
      "reset"      -> "speed_counter_start",
      "resetMean"  -> "time_filter_depth",
      "resetSpeed" -> "speed_filter_depth"
    )
    for ((task, register) <- resets) {
      val due = RegInit(false.B) // reset: the engine begins with zeros
      when(clocks.askBack(task, due)) { due := false.B }
      when(bus.writes(register)) { due := true.B }
    }
    reads(odd)
  }

  /** Where the words of [[ClockProgram.Shown]] stand, by the eight bytes of their registers. */
  private val places = Map(
    ClockRegisters.Delay      -> Shown.Drift,
    ClockRegisters.SpeedStart -> Shown.Drift,
    ClockRegisters.SystemTime -> Shown.Time,
    ClockRegisters.StartTime  -> Shown.Next0,
    ClockRegisters.NextSync1  -> Shown.Next1
  ) ++ (0 until 4).map(e => ClockRegisters.LatchTimes + 8 * e -> (Shown.Latch + e))

  /** What is read are settings, receive times, or words that have a place for frames and one for the host. */
  private def reads(odd: Bool): Unit = {
    val engine  = clocks.engine
    val address = (read.address << laneBits).pad(12)(7, 0)
    def isAt(register: Int, bytes: Int): Bool = {
      val low = log2Ceil(bytes)
      address(7, low) === ((register & 0xff) >> low).U
    }
    val shown  = Mux1H(places.toSeq.map { case (at, number) => isAt(at, 8) -> number.U(3.W) })
    val isTime = isAt(ClockRegisters.SystemTime, 8)
    engine.readAddress := address >> laneBits
    engine.readWord := Mux(
      read.host.reads,
      Word.ForHost.U | shown,
      Mux(isTime, Word.Frame.U | odd, Word.ForEcat.U | shown)
    )
    val isSetting = isAt(ClockRegisters.Offset, 8) || isAt(ClockRegisters.Delay, 4) ||
      isAt(ClockRegisters.SyncCycles, 8) || isAt(ClockRegisters.Direct, 8)
    val isReceive = isAt(ClockRegisters.Trigger, 32) && !isTime
    read.data := Mux(
      RegNext(isReceive),
      receiveTimes,
      Mux(RegNext(isSetting), engine.settingData, engine.wordData)
    )

    // The host sees a time as it is when it reads the first byte, and waits until that is there.
    val asked                   = (read.host.address << laneBits).pad(12)
    def isAtWord(at: Int): Bool = asked === (at & ~(p.lanes - 1)).U
    def begins(at: Int): Bool =
      isAtWord(at) || (if (at == ClockRegisters.Difference) isAtWord(ClockRegisters.Speed) else false.B)
    val settles = RegInit(0.U(5.W)) // cycles of the copy, and then until the access is done; reset: none
    val isThere = settles(4)
    val asks    = read.host.asks && settles === 0.U
    val firsts = clocks.forHost.map { case (task, number) =>
      val at =
        if (number == Shown.Drift) ClockRegisters.Difference
        else places.collectFirst { case (at, `number`) => at }.get
      task -> at
    }
    when(settles =/= 0.U && !isThere) { settles := settles + 1.U }
    for ((task, at) <- firsts)
      when(clocks.ask(task, asks && begins(at))) {
        settles                                                 := 1.U
        if (task.label == "hostCopy") clocks.copied(task.index) := true.B
      }
    when(!read.host.asks) { settles := 0.U }
    read.host.ready := isThere || !firsts
      .map { case (_, at) => begins(at) }
      .reduceOption(_ || _)
      .getOrElse(false.B)
  }
}
