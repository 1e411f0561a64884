package flyframe.dc

import flyframe.dc.WordEngine.Condition
import flyframe.params.EscParams

/** What the engine of distributed clocks does for SYNC signals, with the start time in 0x0990 and the cycle
  * times in 0x09A0 and 0x09A4: part of [[ClockProgram]].
  */
private[dc] object SyncProgram {
  import ClockProgram.{Input, Is, Out, Shown}
  import ClockProgram.Word._
  import First.{Time, Zero, Word => Of}
  import Second.{Setting, Word => And, Zero => Nothing, Input => From}

  private val (next0, next1) = (Live + Shown.Next0, Live + Shown.Next1)
  private val takeStart      = Add(Zero, Setting(0x0990), to = Some(next0))
  private val addCycle       = Add(Of(next0), Setting(0x09a0, half = true), to = Some(next0))

  /** SYNC1 follows the next pulse of SYNC0. */
  private val follow = Add(Of(next0), Setting(0x09a0, up = 4), to = Some(next1), command = Out.Follow)

  /** Arms the pulse at `next` if it comes within 65 us. */
  private def arm(next: Int, late: String, done: String, narrow: Boolean, command: Int) = Seq(
    Add(Time, Setting(0x0920), to = Some(Front)),
    Add(Of(next), And(Front), to = Some(Front), subtract = true, narrow = narrow),
    Add(Of(Front), From(Input.ToArm), to = Some(Front), subtract = true, narrow = narrow),
    Branch(late, Condition.Negative),
    Branch(done, Condition.Far),
    Add(Zero, And(Front), command = command)
  )

  /** The start time is completed and checked before it is taken (DC-36); a task of its own, as both together
    * are too long to be in front.
    */
  private def prepare(narrow: Boolean) = Seq(
    "prepare" -> Seq(
      takeStart,
      Add(Time, Setting(0x0920), to = Some(Front)),
      Branch("whole", Is.Extended, when = false),
      Add(Of(next0), And(Front), to = Some(next0), subtract = true, narrow = true),
      Add(Of(next0), And(Front), to = Some(next0))
    ),
    "whole" -> Seq(
      Add(Of(next0), And(Front), to = Some(Front), subtract = true, narrow = narrow),
      Branch("implausible", Condition.Negative),
      Branch("prepared", Is.Near, when = false),
      Add(Of(Front), From(Input.Bit7, low = 3), subtract = true),
      Branch("prepared", Condition.Negative)
    ),
    "implausible" -> Seq(
      Add(Zero, Nothing, command = Out.Implausible),
      Branch("prepared", Is.Checked, when = false),
      Add(Time, Setting(0x0920), to = Some(next0)),
      Add(Of(next0), From(Input.Most), to = Some(next0))
    ),
    "prepared" -> Seq(End),
    "start"    -> Seq(follow, Branch("check"))
  )

  private def pulses(narrow: Boolean) = Seq(
    // SYNC1 has had its pulse: it follows a pulse of SYNC0 that is still to come (DC-32, OP-05).
    "fired1" -> Seq(
      Add(Of(next1), And(next0), subtract = true),
      Branch("check1", Condition.Negative, when = false),
      follow,
      Branch("check1")
    ),
    // SYNC0 has had its pulse: with a cycle time of 0 the only one.
    "fired0" -> Seq(
      Add(Zero, Setting(0x09a0, half = true), subtract = true),
      Branch("goOn", Condition.Negative),
      Add(Zero, Nothing, command = Out.Stop),
      End
    ),
    "goOn" -> Seq(addCycle, Branch("check", Is.Following), follow),
    "check" -> (Branch("check1", Is.Waiting0, when = false) +:
      arm(next0, "late0", "check1", narrow, Out.Arm0)),
    "check1" -> (Branch("checked", Is.Waiting1, when = false) +:
      arm(next1, "late1", "checked", narrow, Out.Arm1)),
    "checked" -> Seq(End),
    // A pulse whose time has passed is left out; a start in the past never comes (DC-27).
    "late0" -> Seq(Branch("check1", Is.Started, when = false), addCycle, Branch("check1")),
    "late1" -> Seq(
      Add(Of(next1), And(next0), subtract = true),
      Branch("checked", Condition.Negative, when = false),
      follow,
      End
    )
  )

  /** Its steps, with 32 bits or 64, as far as they are built. */
  def apply(p: EscParams): Seq[(String, Seq[Step])] = {
    val narrow = p.clockBits == 32
    (if (p.hasEnhancedSync) prepare(narrow) else Seq("start" -> Seq(takeStart, follow, Branch("check")))) ++
      pulses(narrow)
  }
}
