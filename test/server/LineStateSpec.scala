package flyframe.server

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.DetectorState
import flyframe.protocol.EventKind._

class LineStateSpec extends AnyFlatSpec {
  private def present(position: Int, node: Int, epoch: Int = 1) =
    Event(Present, position, node, sequence = 0x5535, state = 1, epoch = epoch)
  private def found(position: Int, node: Int, epoch: Int = 1) =
    present(position, node, epoch).copy(kind = Found)
  private def detector(position: Int, node: Int, state: Int, epoch: Int = 1) =
    Event(Detector, position, node, sequence = 1, state = state, epoch = epoch)
  private def lost(position: Int, node: Int) = Event(Lost, position, node)

  private val three                 = Seq(present(0, 1), present(1, 2), present(2, 3), Event(Scanned, 3))
  private def line(events: Event*)  = events.foldLeft(LineState())(_.after(_))
  private def states(l: LineState)  = l.slaves.indices.map(l.detector)
  private def answers(l: LineState) = l.slaves.map(_.answers)

  "SRV-09: labels" should "count pairs" in {
    assert((0 to 5).map(LineState.label) == Seq("1A", "1B", "2A", "2B", "3A", "3B"))
    assert(LineState.label(63) == "32B")
  }

  "SRV-09: a slave that is present" should "stand at its position, with nothing told by its detector" in {
    val l = line(three: _*)
    assert(l.slaves.map(_.node) == Seq(1, 2, 3))
    assert(l.slaves.forall(s => s.answers && s.selfTest == 1 && s.links == 0x5535 && s.epoch == 1))
    assert(states(l) == Seq(None, None, None))
    assert(l.alarms.isEmpty)
  }

  it should "take the place of another one there, and none where one is missing before it" in {
    val l = line(three :+ present(1, 9): _*)
    assert(l.slaves.map(_.node) == Seq(1, 9, 3))
    assert(line(three :+ present(5, 9): _*).slaves.size == 3)
  }

  "SRV-09: a detector" should "have the state it has told last" in {
    import DetectorState._
    var l = line(three: _*)
    for (state <- Seq(Normal, Alarm, Normal, Open, Short, Off)) {
      l = l.after(detector(1, 2, state))
      assert(states(l) == Seq(None, Some(state), None))
      assert(l.alarms == (if (state == Alarm) Seq(1) else Nil))
    }
  }

  it should "be known when it was told before its slave was listed" in {
    val l = line(detector(255, 2, DetectorState.Alarm) +: three: _*)
    assert(states(l) == Seq(None, Some(DetectorState.Alarm), None))
  }

  it should "be unknown after a restart of its slave, until it is told again" in {
    val l = line(three :+ detector(1, 2, DetectorState.Alarm): _*)
    assert(states(l.after(found(1, 2, epoch = 2))) == Seq(None, None, None))
    assert(states(l.after(found(1, 2))) == states(l))
    assert(states(l.after(present(1, 2))) == states(l), "listed anew, not restarted")
    val told = l.after(detector(1, 2, DetectorState.Normal, epoch = 2))
    assert(states(told) == Seq(None, Some(DetectorState.Normal), None), "restarted without being missed")
  }

  "SRV-09: slaves that are lost and found" should "stay in their places and keep what they told" in {
    val cut = line((three :+ detector(2, 3, DetectorState.Alarm)) ++ Seq(lost(1, 2), lost(2, 3)): _*)
    assert(answers(cut) == Seq(true, false, false))
    assert(cut.alarms == Seq(2))
    val mended = cut.after(found(1, 2)).after(found(2, 3)).after(Event(Scanned, 3))
    assert(answers(mended) == Seq(true, true, true))
    assert(states(mended) == states(cut))
  }

  "SRV-09: a slave with the ID of another" should "say so, and its detector be unknown" in {
    val l = line(
      present(0, 1),
      present(1, 1),
      Event(Duplicate, 1, 1, sequence = 0),
      detector(0, 1, DetectorState.Alarm)
    )
    assert(l.slaves.map(_.twin) == Seq(None, Some(0)))
    assert(l.alarms == Seq(0))
    assert(l.after(present(1, 2)).slaves.map(_.twin) == Seq(None, None))
  }

  "SRV-09: a gap in the IDs" should "be told of the slave behind it" in {
    val l = line(present(0, 1), present(1, 5), Event(Gap, 1, 5, sequence = 1))
    assert(l.slaves.map(_.before) == Seq(None, Some(1)))
  }

  "SRV-09: slaves behind the last one that can be listed" should "be counted" in {
    assert(line(three :+ Event(Scanned, 3, node = 5): _*).beyond == 2)
    assert(line(three :+ Event(Scanned, 3, node = 5) :+ Event(Scanned, 3, node = 3): _*).beyond == 0)
    assert(EventText.text(Event(Scanned, 64, node = 66)) == "line listed, slaves: 64 of 66 that answer")
  }

  "SRV-09: other events" should "leave the line as it is, and so those about slaves that are not there" in {
    val l = line(three: _*)
    for (
      e <- Seq(
        Event(Scanned, 3),
        Event(Command, 1, 0xffff),
        Event(99, 1, 2),
        Event(Lost, 7),
        Event(Gap, 255),
        Event(Duplicate, 3)
      )
    )
      assert(l.after(e) == l, e)
  }

  "SRV-09, LM-08: every kind of event" should "have a text" in {
    val texts = (1 to 9).map(kind => EventText.text(Event(kind, 1, 2, 3, 1)))
    assert(texts.distinct.size == 9 && texts.forall(_.nonEmpty))
    assert(EventText.text(detector(3, 4, DetectorState.Alarm)) == "alarm")
    assert(EventText.label(detector(3, 4, DetectorState.Alarm)) == "2B")
    assert(EventText.text(Event(Command, 1, 0xffff)) == "alarm clear: done")
    assert(EventText.text(Event(Command, 2, 7, state = 3)) == "detector reset, ID 7: no such ID")
    assert(
      EventText.label(Event(Command, 1, 0xffff)) == "" && EventText.node(Event(Command, 1, 0xffff)).isEmpty
    )
  }
}
