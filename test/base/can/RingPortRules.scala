package flyframe.can

/** What is different in a port on a ring. */
abstract class RingPortRules extends CanCases {
  import CanCases._

  "FB-11: a recessive FDF" should "be a form error on the ring" in all(Frames) { (t, frame) =>
    val wire = Wire(frame, fdf = '1')
    t.quietly(wire.levels.take(wire.at("fdf") + 1))
    t.errorFrame()
    assert(t.counter("form_errors") == 1 && t.rec == 1)
    t.sendAcked(Wire(frame))
    t.intermission()
    assert(t.received() == Seq(frame) && t.rec == 0)
  }
}
