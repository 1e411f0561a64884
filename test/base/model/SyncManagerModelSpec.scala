package flyframe.model

import org.scalatest.flatspec.AnyFlatSpec
import Side.{Ecat, Pdi}

/** One SyncManager by itself. */
class SyncManagerModelSpec extends AnyFlatSpec {
  private val Start = 0x1000

  private class Bench(control: Int, length: Int = 4, limit: Int = 0x2000) {
    var triggers = 0
    val sm       = new SyncManagerModel(_ < limit, () => triggers += 1)
    sm.configure(SyncManagerSettings(Start, length, control, enabled = true))

    /** The buffers that accesses to these offsets reach, None where denied. */
    def access(side: Side, write: Boolean, offsets: Range): Seq[Option[Int]] =
      offsets.map(o => sm.access(side, write, Start + o).map(a => (a - Start - o) / length))
    def frame(write: Boolean, offsets: Range, good: Boolean = true): Seq[Option[Int]] = {
      sm.frameStarts()
      val result = access(Ecat, write, offsets)
      sm.frameEnds(good)
      result
    }
    def buffer(k: Int): Seq[Option[Int]] = Seq.fill(length)(Some(k))
    val denied: Seq[Option[Int]]         = Seq.fill(length)(None)
    val all: Range                       = 0 until length
  }
  private def ecatBuffer  = new Bench(0x04)
  private def pdiBuffer   = new Bench(0x00)
  private def ecatMailbox = new Bench(0x06)

  "SM-01: before the start address" should "everything be denied" in {
    val b = ecatBuffer
    assert(b.frame(write = true, 1 to 3) == Seq(None, None, None))
    assert(b.frame(write = true, 0 to 0) == Seq(Some(0)))
    assert(b.frame(write = true, 1 to 2) == Seq(Some(0), Some(0)))
  }
  "SM-04, B-56: after the end address" should "the frame's further accesses be denied" in {
    val b = ecatBuffer
    b.sm.frameStarts()
    assert(b.access(Ecat, write = true, 0 to 3) == b.buffer(0))
    assert(b.access(Ecat, write = true, 0 to 3) == b.denied)
    b.sm.frameEnds(good = true)
    assert(b.frame(write = true, 0 to 3) == b.buffer(1))
  }
  "SM-05: closing" should "wait for the good frame with ECAT, not with the PDI" in {
    val b = ecatBuffer
    b.sm.frameStarts()
    b.access(Ecat, write = true, b.all)
    assert(b.sm.lastBuffer == 3 && !b.sm.writeEvent)
    b.sm.frameEnds(good = true)
    assert(b.sm.lastBuffer == 0 && b.sm.writeEvent)
    val c = pdiBuffer
    c.access(Pdi, write = true, c.all)
    assert(c.sm.lastBuffer == 0 && c.sm.writeEvent)
  }
  "SM-07, B-57: a bad frame" should "close what it touched and change no hands" in {
    val b = ecatBuffer
    b.frame(write = true, 0 to 1)
    b.frame(write = true, 2 to 3, good = false)
    assert(b.sm.lastBuffer == 3)
    assert(b.frame(write = true, 2 to 2) == Seq(None))
    val c = pdiBuffer
    c.access(Pdi, write = true, c.all)
    assert(c.frame(write = false, c.all, good = false) == c.buffer(0))
    c.access(Pdi, write = true, c.all)
    assert(c.sm.lastBuffer == 1, "the NEXT taken stays taken")
    assert(c.frame(write = false, c.all) == c.buffer(1))
  }
  "SM-12, SM-13, SM-14: the three buffers" should "go round" in {
    val b = ecatBuffer
    assert(b.frame(write = true, b.all) == b.buffer(0))
    assert(b.access(Pdi, write = false, b.all) == b.buffer(0))
    assert(b.frame(write = true, b.all) == b.buffer(1))
    assert(b.frame(write = true, b.all) == b.buffer(2))
    assert(b.frame(write = true, b.all) == b.buffer(1), "never the one being read")
    assert(b.access(Pdi, write = false, b.all) == b.buffer(1))
    assert(b.access(Pdi, write = false, b.all) == b.buffer(1), "nothing newer")
  }
  "SM-13: random accesses of both sides" should "read whole messages in order" in {
    val random = new scala.util.Random(5)
    for (control <- Seq(0x00, 0x04)) {
      val b       = new Bench(control, length = 3)
      val memory  = new Array[Int](0x3000)
      var message = 0
      var last    = 0
      val writer  = if (control == 4) Ecat else Pdi
      val reader  = if (control == 4) Pdi else Ecat
      def one(side: Side, write: Boolean, offset: Int)(f: Int => Unit): Unit = {
        if (side == Ecat) b.sm.frameStarts()
        b.sm.access(side, write, Start + offset).foreach(f)
        if (side == Ecat) b.sm.frameEnds(good = true)
      }
      var (writeAt, readAt) = (0, 0)
      var reading           = 0
      for (_ <- 0 until 5000)
        if (random.nextBoolean()) {
          if (writeAt == 0) message += 1
          one(writer, write = true, writeAt)(memory(_) = message)
          writeAt = (writeAt + 1) % 3
        } else {
          var found = false
          one(reader, write = false, readAt) { a =>
            found = true
            if (readAt == 0) { reading = memory(a); assert(reading >= last && reading >= message - 2) }
            else assert(memory(a) == reading)
            last = reading
          }
          if (found) readAt = (readAt + 1) % 3
        }
      assert(last > 500)
    }
  }
  "SM-15, SM-16: before the first complete write" should "nothing be readable and the status be 3" in {
    val b = ecatBuffer
    assert(b.sm.lastBuffer == 3 && b.access(Pdi, write = false, b.all) == b.denied)
    b.frame(write = true, 0 to 2)
    assert(b.access(Pdi, write = false, b.all) == b.denied)
  }
  "SM-18, SM-19, SM-20: a mailbox" should "be empty, full, empty" in {
    val b = ecatMailbox
    assert(b.access(Pdi, write = false, b.all) == b.denied && !b.sm.mailboxFull)
    assert(b.frame(write = true, b.all, good = false) == b.buffer(0) && !b.sm.mailboxFull)
    assert(b.frame(write = true, b.all) == b.buffer(0) && b.sm.mailboxFull)
    assert(b.frame(write = true, b.all) == b.denied)
    assert(b.access(Pdi, write = false, b.all) == b.buffer(0) && !b.sm.mailboxFull)
    assert(b.access(Pdi, write = false, b.all) == b.denied)
  }
  "SM-21, SM-22: complete accesses" should "raise events, writes trigger the watchdog" in {
    val b = new Bench(0x46)
    b.frame(write = true, b.all)
    assert(b.sm.writeEvent && !b.sm.readEvent && b.triggers == 1)
    b.access(Pdi, write = false, 0 to 0)
    assert(!b.sm.writeEvent)
    b.access(Pdi, write = false, 1 to 3)
    assert(b.sm.readEvent && b.triggers == 1)
    b.frame(write = true, 0 to 0)
    assert(!b.sm.readEvent)
  }
  "SM-24, B-53: length 1" should "be plain memory with events" in {
    for (control <- Seq(0x04, 0x06)) {
      val b = new Bench(control, length = 1)
      assert(b.frame(write = false, 0 to 0) == Seq(Some(0)) && !b.sm.readEvent)
      assert(b.frame(write = true, 0 to 0) == Seq(Some(0)) && b.sm.writeEvent)
      assert(b.frame(write = true, 0 to 0) == Seq(Some(0)))
      assert(b.access(Pdi, write = false, 0 to 0) == Seq(Some(0)) && b.sm.readEvent && !b.sm.writeEvent)
      assert(!b.sm.mailboxFull && b.sm.lastBuffer == (if (control == 4) 3 else 0))
    }
  }
  "SM-25: length 0" should "cover nothing" in {
    assert(!new Bench(0x04, length = 0).sm.settings.covers(Side.Ecat, write = true, Start))
  }
  "SM-27, B-51: deactivation" should "reset and lock all three buffers, or the mailbox" in {
    for ((control, bytes) <- Seq(0x04 -> 12, 0x06 -> 4)) {
      val b = new Bench(control)
      b.frame(write = true, b.all)
      b.sm.configure(b.sm.settings.copy(deactivated = true))
      assert(
        (-1 to 13).filter(o => b.sm.settings.covers(Side.Ecat, write = true, Start + o)) == (0 until bytes)
      )
      assert(b.frame(write = true, b.all) == b.denied && b.access(Pdi, write = false, b.all) == b.denied)
      b.sm.configure(b.sm.settings.copy(deactivated = false))
      assert(!b.sm.writeEvent && b.access(Pdi, write = false, b.all) == b.denied)
      assert(b.frame(write = true, b.all) == b.buffer(0))
    }
  }
  "SM-28: disabling" should "leave the addresses alone at once" in {
    val b = ecatBuffer
    b.sm.configure(b.sm.settings.copy(enabled = false))
    assert(!b.sm.settings.covers(Side.Ecat, write = true, Start))
  }
  "OP-11, B-54: the wrong direction" should "be denied" in {
    val b = ecatMailbox
    b.frame(write = true, b.all)
    assert(b.frame(write = false, b.all) == b.denied && b.access(Pdi, write = true, b.all) == b.denied)
    assert(b.sm.mailboxFull)
  }
  "B-52: a buffer beyond the RAM" should "have no data there, but be opened and closed all the same" in {
    val b = new Bench(0x04, limit = Start + 10) // buffer 2 has two bytes only
    assert(b.frame(write = true, b.all) == b.buffer(0))
    assert(b.access(Pdi, write = false, b.all) == b.buffer(0))
    assert(b.frame(write = true, b.all) == b.buffer(1))
    assert(b.frame(write = true, b.all) == Seq(Some(2), Some(2), None, None))
    assert(b.sm.lastBuffer == 2)
  }
  "B-52: a first buffer beyond the RAM" should "never close" in {
    val b = new Bench(0x04, limit = Start + 3)
    assert(b.frame(write = true, b.all) == Seq(Some(0), Some(0), Some(0), None))
    assert(b.sm.lastBuffer == 3)
  }
}
