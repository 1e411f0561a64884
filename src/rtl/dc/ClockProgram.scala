package flyframe.dc

import flyframe.dc.WordEngine.{Command, Condition}
import flyframe.params.EscParams

/** What the engine of distributed clocks does: its words, tasks and the steps of these.
  *
  * Tasks in front are short, as none begins before the one at hand has ended: at most 21 rounds. The
  * registers are those of [[flyframe.registers.ClockRegisters]].
  */
object ClockProgram {

  /** Words of the engine. Those of the drift control:
    *
    *   - `Mean`: mean difference of the system time (0x092C), in 1/65536 ns
    *   - `Integral`: deviation of the speed (speed counter difference), in 1/65536
    *   - `Speed`: the same, averaged, in 2^-32^
    *   - `Rest`: what is left to correct, in 1/256 ns
    *   - `Difference`: of the system time in the frame at hand, ns
    */
  object Word {
    val Mean       = 0
    val Integral   = 1
    val Speed      = 2
    val Difference = 3
    val Rest       = 4
    val Scratch    = 5

    /** Of the background too; 8 to 14 are [[Live]], and 15 is [[Front]]. Of the words behind those it takes
      * one that nobody has: [[ForEcat]] and [[Shown.Time]], as frames read the time at [[Frame]].
      */
    val Limit = 23

    /** Of tasks in front. */
    val Front = 15

    /** System time when a frame has begun, less the delay; every other frame has the other one. */
    val Frame = 6

    /** What registers show, by the numbers of [[Shown]]: as it is, as a frame sees it, and the host. A frame,
      * and the host from the first byte on, see all bytes of the same time.
      */
    val Live    = 8
    val ForEcat = 16
    val ForHost = 24
  }

  /** Words that registers show. */
  object Shown {

    /** Mean difference (0x092C, places 4 to 7) and speed counter difference (0x0932, places 2 and 3). */
    val Drift = 0

    /** Next pulses of SYNC0 and SYNC1 (0x0990, 0x0998). */
    val Next0 = 1
    val Next1 = 2

    /** Positive and negative edge of LATCH0, then of LATCH1 (0x09B0 on). */
    val Latch = 3

    /** System time (0x0910), which is not kept, but calculated for whoever asks. */
    val Time = 7
  }

  /** Numbers from outside. */
  object Input {

    /** Time since what the task in front is for, ns; speed counter start; ns from the round that takes the
      * time to the end of the one that arms a pulse.
      */
    val Age        = 0
    val SpeedStart = 1
    val ToArm      = 2
    val Count      = 3

    /** Constants: 0x80, 0x7F, 16384, and 16. */
    val Bit7      = 3
    val Least     = 4
    val Most      = 5
    val Sixteen   = 6
    val Constants = Seq(0x80, 0x7f, 16384, 16)
  }

  /** Conditions from outside. */
  object Is {

    /** A pulse of the signal is to come, and it is not armed. */
    val Waiting0 = Condition.Outside
    val Waiting1 = Condition.Outside + 1

    /** SYNC0 has had its first pulse; SYNC1 follows a pulse of SYNC0. */
    val Started   = Condition.Outside + 2
    val Following = Condition.Outside + 3

    /** The start time has only its lower half; it is checked; the near future is 2^31 ns. */
    val Extended = Condition.Outside + 4
    val Checked  = Condition.Outside + 5
    val Near     = Condition.Outside + 6
    val Count    = 7
  }

  /** Commands to outside. */
  object Out {

    /** ns that the local time is to fall back by and by; cycles between those that it loses, less 2, and
      * between those that it wins.
      */
    val Slew = Command.Outside
    val Lose = Command.Outside + 1
    val Win  = Command.Outside + 2

    /** The pulse of the signal comes in so many ns. */
    val Arm0 = Command.Outside + 3
    val Arm1 = Command.Outside + 4

    /** No pulse of SYNC0 comes any more; SYNC1 follows a pulse of SYNC0. */
    val Stop   = Command.Outside + 5
    val Follow = Command.Outside + 6

    /** The time of an edge is there. */
    val Caught = Command.Outside + 7

    /** The start time is not in the near future. */
    val Implausible = Command.Outside + 8
    val Count       = 9
  }

  import First.{Time, Zero, Word => Of}
  import Second.{Setting, Word => And, Zero => Nothing, Input => From}
  import Word._

  private val doubleOnce = Add(Of(Scratch), And(Scratch), to = Some(Scratch))
  private val double     = doubleOnce.copy(repeats = true)

  /** The system time when the frame has begun, as the reference clock has sent it (DC-17); and what else the
    * frame may read.
    */
  private def frame(shown: Seq[Int]) = "frame" -> (Seq(
    Add(Time, From(Input.Age), to = Some(Frame), toIndexed = true, subtract = true),
    Add(Of(Frame, indexed = true), Setting(0x0920), to = Some(Frame), toIndexed = true),
    Add(Of(Frame, indexed = true), Setting(0x0928), to = Some(Frame), toIndexed = true, subtract = true)
  ) ++ shown.map(w => Add(Zero, And(Live + w), to = Some(ForEcat + w))) :+ End)

  private val host = Seq(
    "hostTime" -> Seq(Add(Time, Setting(0x0920), to = Some(ForHost + Shown.Time)), End),
    "hostCopy" -> Seq(
      Add(Zero, And(Live, indexed = true), to = Some(ForHost), toIndexed = true),
      End
    )
  )

  /** The time of the reference clock has come: with a frame, which began at one of two times (DC-17), or from
    * the host, for the positive edge of LATCH0 (DC-24).
    */
  private def samples(p: EscParams) = {
    def of(word: Int) = Add(Of(word), Setting(0x0910), to = Some(Difference), subtract = true, narrow = true)
    if (p.hasTimeByPdi) Seq("sampleOfLatch" -> Seq(of(Live + Shown.Latch)))
    else Seq("sampleOf1" -> Seq(of(Frame + 1), Branch("average")), "sampleOf0" -> Seq(of(Frame)))
  }

  /** The speed is set directly where that is not 0 (DC-25, B-112). */
  private def isDirect(p: EscParams, orElse: Step*): Seq[Step] =
    (if (p.hasDirectSpeed)
       Seq(Add(Zero, Setting(0x0938), subtract = true), Branch("direct", Condition.Negative))
     else Nil) ++ orElse
  private val direct = Seq(
    "setSpeed" -> Seq(
      Add(Zero, Setting(0x0938), subtract = true),
      Branch("direct", Condition.Negative),
      End
    ),
    "direct" -> Seq(
      Add(Zero, Setting(0x0938, up = -2), to = Some(Integral), narrow = true),
      Branch("bound")
    )
  )

  /** It is compared: DC-17 to DC-19, B-84, B-85. */
  private def sample(p: EscParams) = Seq(
    "average" -> Seq(
      Add(
        Of(Difference),
        And(Mean, up = 2),
        to = Some(Scratch),
        subtract = true,
        command = Command.Depth
      ),
      double,
      Add(Of(Mean), And(Scratch), to = Some(Mean)),
      Add(Zero, And(Mean, up = 2), to = Some(Scratch)),
      Branch("below", Condition.Negative),
      Add(Of(Scratch), From(Input.Bit7, low = 3), to = Some(Scratch)),
      Branch("show")
    ),
    "below" -> Seq(Add(Zero, And(Scratch), to = Some(Scratch), subtract = true)),
    "show"  -> Seq(Add(Zero, And(Scratch, up = -4), to = Some(Live + Shown.Drift), places = Places.Upper)),
    // More than 16384 ns are no matter of speed: 4096 of them are corrected.
    "compare" -> isDirect(
      p,
      Add(Of(Difference), From(Input.Most)),
      Branch("farBehind", Condition.Negative),
      Add(Of(Difference), From(Input.Most), subtract = true),
      Branch("near", Condition.Negative),
      Add(Zero, From(Input.Sixteen, low = 2), to = Some(Scratch)),
      Branch("correct")
    ),
    "farBehind" -> Seq(
      Add(Zero, From(Input.Sixteen, low = 2), to = Some(Scratch), subtract = true),
      Branch("correct")
    ),
    "near" -> Seq(
      Add(Of(Difference), From(Input.Bit7)),
      Branch("follow", Condition.Negative),
      Add(Of(Difference), From(Input.Bit7), subtract = true),
      Branch("follow", Condition.Negative, when = false)
    ),
    // Less than 128 ns come from the ways of frames, too, of which no two take the same time: a sixteenth of
    // them is corrected, and the speed counter difference changes by 1 per 32 ns.
    "calm" -> Seq(
      Add(Of(Difference), And(Difference), to = Some(Scratch)),
      doubleOnce,
      doubleOnce,
      Add(Of(Integral), And(Scratch, up = -1), to = Some(Integral)),
      doubleOnce,
      Branch("correct")
    ),
    // Of more it is a quarter, and 1 per 16 ns.
    "follow" -> Seq(
      Add(Zero, And(Difference), to = Some(Scratch), command = Command.Four),
      double,
      Add(Of(Integral), And(Scratch, up = -1), to = Some(Integral)),
      doubleOnce,
      doubleOnce
    ),
    // At once, but what is less than 1 ns.
    "correct" -> Seq(
      Add(Of(Rest), And(Scratch), to = Some(Rest)),
      Add(Zero, And(Rest, up = 1), command = Out.Slew),
      Add(Zero, Nothing, to = Some(Rest), places = Places.Rest)
    ),
    // The speed counter difference stays within the speed counter start - 0x7F.
    "bound" -> Seq(
      Add(Zero, From(Input.SpeedStart, low = 2), to = Some(Limit)),
      Add(Of(Limit), From(Input.Least, low = 2), to = Some(Limit), subtract = true),
      Branch("limit", Condition.Negative, when = false),
      Add(Zero, Nothing, to = Some(Limit))
    ),
    "limit" -> Seq(
      Add(Of(Limit), And(Integral)),
      Branch("tooSlow", Condition.Negative),
      Add(Of(Limit), And(Integral), subtract = true),
      Branch("smooth", Condition.Negative, when = false),
      Add(Zero, And(Limit), to = Some(Integral)),
      Branch("smooth")
    ),
    "tooSlow" -> Seq(Add(Zero, And(Limit), to = Some(Integral), subtract = true)),
    "smooth" -> Seq(
      Add(
        Of(Integral),
        And(Speed, up = 2),
        to = Some(Scratch),
        subtract = true,
        command = Command.Depth + 1
      ),
      double,
      Add(Of(Speed), And(Scratch), to = Some(Speed)),
      Add(Zero, And(Speed, up = 2), to = Some(Live + Shown.Drift), places = Places.Speed)
    ),
    "drive" -> Seq(
      Add(Zero, From(Input.SpeedStart), to = Some(Scratch)),
      Add(Of(Scratch), And(Integral, up = 2), command = Out.Win),
      Add(Of(Scratch), And(Integral, up = 2), subtract = true, command = Out.Lose),
      End
    )
  )

  private def clear(word: Int, places: Int = Places.All) =
    Add(Zero, Nothing, to = Some(word), places = places)

  /** The filters are reset (DC-20). */
  private def resets(p: EscParams) = Seq(
    "reset" -> (Seq(Mean, Integral, Speed, Rest, Live + Shown.Drift).map(clear(_)) ++
      isDirect(p, Branch("drive"))),
    "resetMean"  -> Seq(clear(Mean), clear(Live + Shown.Drift, Places.Upper), End),
    "resetSpeed" -> Seq(clear(Speed), clear(Live + Shown.Drift, Places.Speed), End)
  )

  // ---- LATCH signals ----
  private val latch = Seq(
    "latch" -> Seq(
      Add(Time, From(Input.Age), to = Some(Live), toIndexed = true, subtract = true),
      Add(Of(Live, indexed = true), Setting(0x0920), to = Some(Live), toIndexed = true, command = Out.Caught),
      End
    )
  )

  /** Words of [[Shown]] that are kept, by the parameters. */
  def shown(p: EscParams): Seq[Int] =
    Seq(Shown.Drift) ++ (0 until p.syncSignals).map(Shown.Next0 + _) ++
      (0 until 2 * p.latchSignals).map(Shown.Latch + _)

  /** All steps, as far as they are built. */
  def apply(p: EscParams): Program = Program(
    (frame(shown(p)) +: host) ++ samples(p) ++ sample(p) ++ resets(p) ++
      (if (p.hasDirectSpeed) direct else Nil) ++
      (if (p.syncSignals > 0) SyncProgram(p) else Nil) ++
      (if (p.latchSignals > 0) latch else Nil)
  )
}
