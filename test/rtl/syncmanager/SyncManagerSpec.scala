package flyframe.syncmanager

import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams
import flyframe.model.{Side, SyncManagerModel, SyncManagerSettings}

/** The buffers of one SyncManager against the golden model, and its corners (SM-01 to SM-28, B-50 to B-58).
  */
class SyncManagerSpec extends AnyFlatSpec with SharedSimulation {

  private val p      = EscParams(syncManagers = 2, applicationLayer = 1, watchdogs = 1, ramKiB = 8)
  private val Number = 1 // of two

  private case class Answer(allowed: Boolean, inBuffer: Boolean, buffer: Int, works: Boolean, locked: Boolean)

  private val byWrites = p.copy(acknowledgeByWrite = 1)

  /** The accessing sides as frame processor and host sequencer are, and the model beside. */
  private class Bench(dut: SyncManagers, control: Int, val length: Int, byWrite: Boolean = false)
      extends Assertions {
    private val start         = 0x1000
    private var modelTriggers = 0
    private var triggers      = 0
    private val model         = new SyncManagerModel(_ => true, () => modelTriggers += 1, byWrite = byWrite)
    private val mailbox       = (control & 2) != 0
    val ecatWrites: Boolean   = (control & 4) != 0
    private def settings      = SyncManagerSettings(start, length, control | 0x40, enabled, deactivated)
    private var enabled       = false
    private var deactivated   = false
    private val single        = length == 1
    private def is(b: chisel3.Bool) = b.peekBoolean()

    for (port <- Seq(dut.ecat, dut.pdi)) {
      port.index.poke(0)
      port.turn.poke(false)
      port.request.poke(false)
      port.number.poke(Number)
      port.access.touch.poke(false)
      port.access.close.poke(false)
      port.access.first.poke(false)
      port.access.write.poke(false)
      port.access.single.poke(single)
      if (byWrite) port.access.acknowledge.poke(0)
    }
    dut.enable.foreach(_.poke(false))
    dut.ramOpen.poke(true)
    dut.quiet.poke(true)
    dut.good.poke(false)
    dut.bad.poke(false)
    write(4, control | 0x40)
    works(enable = false, deactivate = false)

    private def step(): Unit = { if (is(dut.trigger)) triggers += 1; dut.clock.step() }

    private def write(offset: Int, byte: Int): Unit = {
      dut.write.valid.poke(true)
      dut.write.bits.address.poke(0x800 + 8 * Number + offset)
      dut.write.bits.mask.poke(1)
      dut.write.bits.data.poke(byte)
      dut.clock.step()
      dut.write.valid.poke(false)
    }
    private def port(side: Side) = if (side == Side.Ecat) dut.ecat else dut.pdi

    /** One access of a side: what it is told two cycles later. */
    private def ask(
        side: Side,
        write: Boolean,
        first: Boolean,
        touch: Boolean,
        close: Boolean,
        acknowledge: Boolean = false
    ): Answer = {
      val to = port(side)
      to.turn.poke(true)
      to.request.poke(true)
      assert(is(to.granted))
      to.access.write.poke(write)
      to.access.first.poke(first)
      to.access.touch.poke(touch)
      to.access.close.poke(close)
      if (byWrite) to.access.acknowledge.poke(if (acknowledge) 1 else 0)
      step()
      to.turn.poke(false)
      to.request.poke(false)
      to.access.touch.poke(false)
      to.access.close.poke(false)
      if (byWrite) to.access.acknowledge.poke(0)
      step()
      val a = to.answer
      Answer(is(a.allowed), is(a.inBuffer), a.buffer.peekInt().toInt, is(a.works), is(a.locked))
    }

    def works(enable: Boolean, deactivate: Boolean): Unit = {
      enabled = enable; deactivated = deactivate
      dut.enable(Number).poke(enabled)
      write(7, if (deactivated) 1 else 0)
      model.configure(settings)
      step(); step()
      compare("works")
    }

    /** Switched off and on by two register writes in consecutive cycles, while the host asks `before` cycles
      * earlier to later and without a pause.
      */
    def blink(before: Int): Unit = {
      val to = port(Side.Pdi)
      to.access.write.poke(false)
      to.access.first.poke(true)
      for (cycle <- 0 until 6) {
        to.request.poke(cycle >= before)
        dut.enable(Number).poke(cycle != 3)
        step()
      }
      to.request.poke(false)
      enabled = false
      model.configure(settings)
      enabled = true
      model.configure(settings)
      step(); step()
      compare("blink")
    }
    def compare(what: => String): Unit = {
      def bit(is: Boolean, place: Int) = if (is) 1 << place else 0
      val expected = bit(model.writeEvent, 0) | bit(model.readEvent, 1) |
        bit(model.mailboxFull && mailbox, 3) | model.lastBuffer << 4
      assert(status(Number) == expected, s"status after $what")
      assert(triggers == modelTriggers, s"watchdog after $what")
      for (side <- Seq(Side.Ecat, Side.Pdi)) {
        val a = ask(side, write = true, first = false, touch = false, close = false)
        assert(a.works == (enabled && !deactivated) && a.locked == (enabled && deactivated))
      }
      assert(status(0) == 0x30, "the other one")
    }

    /** The status register of a SyncManager. */
    private def status(number: Int): Int = {
      dut.statusIndex.poke(number)
      step()
      dut.status.peekInt().toInt
    }

    /** An access to byte `offset`: the byte of the area it leads to, if it is allowed. */
    def access(side: Side, write: Boolean, offset: Int): Option[Int] = {
      val byEcat   = side == Side.Ecat
      val first    = offset == 0
      val last     = offset == length - 1
      val expected = model.access(side, write, start + offset)
      // A write of ECAT asks first, and touches and closes when it has passed; the others open first and
      // close later.
      val asksOnly = if (byEcat) write else single
      val answer =
        ask(side, write, first, touch = !asksOnly, close = false, acknowledge = !byEcat && write && last)
      if (answer.inBuffer && (last || asksOnly)) ask(side, write, first, touch = asksOnly, close = last)
      if (byEcat && model.takeClosing()) model.close()
      val found = Option.when(answer.allowed)(offset + (if (single) 0 else answer.buffer * length))
      assert(found == expected.map(_ - start), s"$side ${if (write) "writes" else "reads"} byte $offset")
      compare(s"$side byte $offset")
      found
    }
    def frame(good: Boolean): Unit = {
      val end = if (good) dut.good else dut.bad
      end.poke(true)
      step()
      end.poke(false)
      var settled = 0
      for (_ <- 0 until 6) {
        step()
        if (is(dut.settled)) settled += 1
      }
      assert(settled == (if (good) 1 else 0))
      model.frameEnds(good)
      compare(s"frame, good: $good")
    }
    def all(side: Side, write: Boolean): Seq[Option[Int]] = (0 until length).map(access(side, write, _))
  }

  private def check(name: String, control: Int, length: Int = 4, byWrite: Boolean = false)(
      run: Bench => Unit
  ): (String, SyncManagers => Unit) =
    name -> { dut =>
      val b = new Bench(dut, control, length, byWrite)
      b.works(enable = true, deactivate = false)
      run(b)
    }
  private val sides = Seq(0x04 -> "ECAT writes", 0x00 -> "PDI writes")

  private def random(seed: Int, accesses: Int)(b: Bench): Unit = {
    val random = new scala.util.Random(seed)
    var at     = Map[Side, Int](Side.Ecat -> 0, Side.Pdi -> 0)
    for (n <- 0 until accesses) random.nextInt(100) match {
      case 0           => b.works(enable = random.nextBoolean(), deactivate = random.nextInt(3) == 0)
      case 1 | 2       => b.works(enable = true, deactivate = false)
      case r if r < 15 => b.frame(good = random.nextInt(4) > 0)
      case _ =>
        val side  = if (random.nextBoolean()) Side.Ecat else Side.Pdi
        val right = random.nextInt(10) > 0
        val write = ((side == Side.Ecat) == b.ecatWrites) == right
        // Mostly one byte after the other, sometimes anywhere, often the ends.
        val offset = random.nextInt(8) match {
          case 0 => random.nextInt(b.length)
          case 1 => 0
          case 2 => b.length - 1
          case _ => at(side)
        }
        at += side -> (offset + 1) % b.length
        b.access(side, write, offset)
    }
  }

  together("SyncManager that is acknowledged by writes", new SyncManagers(byWrites))(
    (for ((direction, text) <- sides; (mode, length) <- Seq(0 -> 4, 2 -> 4, 0 -> 1, 2 -> 1, 0 -> 2))
      yield check(
        s"SM-36, B-104: control $mode, $length bytes, $text: random accesses of both sides",
        direction | mode,
        length,
        byWrite = true
      )(random(6 + length, 3000))): _*
  )

  together("Sequence", new SyncManager(sequential = true, byWrite = false))(
    "B-101: of any length, up to the last address" -> { dut =>
      dut.settings.works.poke(true)
      dut.settings.locked.poke(false)
      dut.settings.isMailbox.poke(false)
      dut.settings.ecatWrites.poke(true)
      dut.settings.isSequential.poke(true)
      dut.byPdi.poke(false)
      dut.good.poke(false)
      dut.bad.poke(false)
      dut.state.ecatOpen.poke(true)
      dut.state.closed.poke(false)
      dut.access.write.poke(true)
      dut.access.touch.poke(true)
      dut.access.first.poke(false)
      dut.access.close.poke(false)
      dut.access.single.poke(false)
      for (
        (behind, at) <- Seq(0x1001 -> 0x1001, 0x1001 -> 0x1002, 0x1001 -> 0x1000, 0x1001 -> 0x9001) ++
          Seq(0x1001 -> 0x9002, 0x1001 -> 0xffff, 0xffff -> 0xffff, 0x10000 -> 0x1000, 0x10000 -> 0xffff)
      ) {
        dut.state.behind.poke(behind)
        dut.access.address.poke(at)
        assert(dut.after.gap.peekInt() == (if (at > behind) 1 else 0), f"0x$at%x behind 0x$behind%x")
        assert(dut.after.behind.peekInt() == (if (at == behind) at + 1 else behind))
      }
    }
  )

  together("DeactivationDelay", new DeactivationDelay)(
    "SM-29, SM-31, B-102: begins with what there is to read, and does not end within a frame" -> { dut =>
      def set(isOn: Boolean = true, enable: Option[Int] = None, noFrame: Boolean = true): Boolean = {
        dut.isOn.poke(isOn)
        dut.enable.valid.poke(enable.isDefined)
        dut.enable.bits.poke(enable.getOrElse(0))
        dut.wasEnabled.poke(true)
        dut.noFrame.poke(noFrame)
        dut.changes.poke(false)
        dut.clock.step()
        dut.active.peekBoolean()
      }
      assert(!set() && !set(isOn = false, enable = Some(0)), "nothing to read")
      assert(!set(isOn = false, enable = Some(0), noFrame = false), "nor in a frame")
      assert(set(enable = Some(0)) && set(isOn = false, noFrame = false) && set(noFrame = false))
      assert(set(isOn = false, noFrame = false) && !set(isOn = false))
      assert(set(enable = Some(0)) && !set(enable = Some(1)) && dut.restarts.peekBoolean())
      assert(!set() && !dut.restarts.peekBoolean())
    }
  )

  together("SyncManager", new SyncManagers(p))(
    sides.flatMap { case (direction, text) =>
      val (writer, reader) = if (direction == 4) (Side.Ecat, Side.Pdi) else (Side.Pdi, Side.Ecat)
      def end(b: Bench)    = b.frame(good = true)
      Seq(
        check(s"SM-12 to SM-15, B-54: three buffers, $text: the reader gets the newest", direction) { b =>
          assert(b.all(reader, write = false).forall(_.isEmpty), "nothing written yet")
          for (n <- 0 until 5) {
            assert(b.all(writer, write = true).forall(_.isDefined))
            end(b)
            if (n % 2 == 0) { b.all(writer, write = true); end(b) }
            assert(b.all(reader, write = false).forall(_.isDefined))
            end(b)
          }
        },
        check(s"SM-16 to SM-20, B-54: mailbox, $text: full until it is read", direction | 2) { b =>
          for (_ <- 0 until 3) {
            assert(b.all(reader, write = false).forall(_.isEmpty), "empty")
            assert(b.all(writer, write = true) == (0 until 4).map(Some(_)))
            end(b)
            assert(b.all(writer, write = true).forall(_.isEmpty), "full")
            assert(b.all(reader, write = false) == (0 until 4).map(Some(_)))
            end(b)
          }
        },
        check(s"SM-01, B-54: $text: only the first byte opens", direction) { b =>
          for (i <- Seq(3, 1, 2)) assert(b.access(writer, write = true, i).isEmpty)
          assert(b.access(writer, write = true, 0).isDefined)
          for (i <- Seq(3, 1, 2))
            assert(b.access(writer, write = true, i).isDefined == (i == 3), "the last byte closes")
          end(b)
        },
        check(s"SM-05, OP-11: $text: the wrong direction is denied", direction) { b =>
          b.all(writer, write = true); end(b)
          assert(b.all(writer, write = false).forall(_.isEmpty))
          assert(b.all(reader, write = true).forall(_.isEmpty))
          end(b)
        },
        check(s"B-53: one byte, $text: plain memory with events", direction, length = 1) { b =>
          for (side <- Seq(writer, reader); write <- Seq(true, false)) {
            assert(b.access(side, write, 0).contains(0))
            end(b)
          }
        },
        check(s"SM-12 to SM-16: three buffers, $text: random accesses of both sides", direction)(
          random(1, 4000)
        ),
        check(s"SM-17 to SM-20: mailbox, $text: random accesses of both sides", direction | 2)(
          random(2, 4000)
        ),
        check(s"B-53: one byte, $text: random accesses of both sides", direction, 1)(random(3, 1000)),
        check(s"B-53: mailbox of one byte, $text: random accesses", direction | 2, 1)(random(4, 1000)),
        check(s"SM-12 to SM-16: two bytes, $text: random accesses of both sides", direction, 2)(
          random(5, 2000)
        )
      )
    } ++ Seq(
      check("SM-04, B-56: nothing more in the frame that closed the buffer", 0x04) { b =>
        b.all(Side.Ecat, write = true)
        for (i <- 0 until 4) assert(b.access(Side.Ecat, write = true, i).isEmpty)
        b.frame(good = true)
        assert(b.access(Side.Ecat, write = true, 0).isDefined)
        b.frame(good = true)
      },
      check("FP-35, B-57: a bad frame hands nothing over, and its buffer must be opened anew", 0x04) { b =>
        b.all(Side.Ecat, write = true)
        b.frame(good = false)
        assert(b.access(Side.Pdi, write = false, 0).isEmpty)
        assert(b.access(Side.Ecat, write = true, 1).isEmpty)
        b.frame(good = true)
      },
      check("SM-28, B-50: off for a single cycle, it begins anew, whatever the host asks meanwhile", 0x04) {
        b =>
          for (before <- 0 to 5) {
            b.all(Side.Ecat, write = true)
            b.frame(good = true)
            b.all(Side.Ecat, write = true)
            b.blink(before)
            assert(b.access(Side.Pdi, write = false, 0).isEmpty, s"asked from cycle $before on")
            b.frame(good = true)
          }
      },
      check(
        "SM-03: a buffer stays open from frame to frame, and through bad ones that do not touch it",
        0x04
      ) { b =>
        b.access(Side.Ecat, write = true, 0)
        b.frame(good = true)
        b.frame(good = false)
        assert(b.access(Side.Ecat, write = true, 1).isDefined)
        b.frame(good = true)
        assert(b.access(Side.Ecat, write = true, 3).isDefined)
        b.frame(good = true)
        assert(b.access(Side.Pdi, write = false, 0).isDefined)
      }
    ): _*
  )
}
