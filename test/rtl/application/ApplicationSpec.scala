package flyframe.application

import chisel3._
import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams

/** Events, and what happens when two things meet in one cycle: AL-04, AL-05, IRQ-01, IRQ-08, B-41, B-42. */
class ApplicationSpec extends AnyFlatSpec with SharedSimulation {
  private class Bench(val dut: Application) extends Assertions {
    private val pulses =
      Seq(dut.alControlWritten, dut.alControlRead, dut.readDlStatus, dut.readAlStatus, dut.good, dut.bad)
    for (input <- pulses :+ dut.emulation :+ dut.watchdog) input.poke(false)
    for (i <- Seq(dut.smEcatEvents, dut.smAlEvents, dut.smChanged, dut.ecatMask, dut.alMask, dut.dlStatus))
      i.poke(0)
    dut.alControl.poke(1)
    dut.alStatus.poke(1)
    dut.clock.step()

    /** One cycle with these inputs high. */
    def step(high: Bool*): Unit = {
      high.foreach(_.poke(true))
      dut.clock.step()
      high.foreach(_.poke(false))
    }
    def dl: Boolean      = (dut.ecatEvents.peek().litValue.toInt >> 2 & 1) == 1
    def al: Boolean      = (dut.ecatEvents.peek().litValue.toInt >> 3 & 1) == 1
    def control: Boolean = (dut.alEvents.peek().litValue.toInt & 1) == 1
    def free: Boolean    = dut.alControlFree.peek().litToBoolean
  }
  private def check(name: String)(run: Bench => Unit): (String, Application => Unit) =
    name -> (dut => run(new Bench(dut)))

  // Both change events behave alike.
  private def change(bit: String, event: Bench => Boolean, set: (Bench, Int) => Unit, read: Bench => Bool) =
    Seq(
      check(s"B-42: $bit rises with a change and ends with the good end of a frame that read it") { b =>
        assert(!event(b), "Init is no change")
        set(b, 4)
        b.step()
        assert(event(b))
        b.step(read(b))
        assert(event(b), "not before the end")
        b.step(b.dut.bad)
        assert(event(b), "nor with a bad one")
        b.step(b.dut.good)
        assert(event(b), "that was another frame")
        b.step(read(b))
        b.step()
        b.step(b.dut.good)
        assert(!event(b))
        set(b, 4)
        b.step()
        assert(!event(b), "not changed")
        set(b, 2)
        b.step()
        assert(event(b))
      },
      check(s"B-42: $bit: a change in the very cycle of the acknowledge wins") { b =>
        set(b, 4)
        b.step()
        b.step(read(b))
        set(b, 8)
        b.step(b.dut.good)
        assert(event(b))
        b.step(b.dut.good)
        assert(event(b), "that frame did not read")
        b.step(read(b))
        b.step(b.dut.good)
        assert(!event(b))
      },
      check(s"B-42: $bit: a change between the read and the end of the frame is not lost") { b =>
        b.step(read(b))
        set(b, 4)
        b.step()
        b.step(b.dut.good)
        assert(event(b), "the frame read the value before")
        b.step(read(b))
        b.step(b.dut.good)
        assert(!event(b))
      }
    )

  // Five SyncManagers: not all that the registers have room for.
  private val p = EscParams(syncManagers = 5, applicationLayer = 1, watchdogs = 1)
  together("five SyncManagers", new Application(p))(
    change("AL status event", _.al, (b, v) => b.dut.alStatus.poke(v), _.dut.readAlStatus) ++
      change("DL status event", _.dl, (b, v) => b.dut.dlStatus.poke(v), _.dut.readDlStatus) ++ Seq(
        check("B-42: a read of one status ends the event of the other not") { b =>
          b.dut.alStatus.poke(2)
          b.dut.dlStatus.poke(2)
          b.step()
          assert(b.al && b.dl)
          b.step(b.dut.readAlStatus)
          b.step(b.dut.good)
          assert(!b.al && b.dl)
          b.step(b.dut.readDlStatus)
          b.step(b.dut.good)
          assert(!b.al && !b.dl)
        },
        check("AL-04, B-41: a write closes AL control until the PDI reads") { b =>
          assert(b.free && !b.control)
          b.step(b.dut.alControlWritten)
          assert(!b.free && b.control)
          b.step(b.dut.good)
          assert(!b.free && b.control)
          b.step(b.dut.alControlRead)
          assert(b.free && !b.control)
        },
        check("B-41: a write in the very cycle of the read wins") { b =>
          b.step(b.dut.alControlWritten)
          b.step(b.dut.alControlRead, b.dut.alControlWritten)
          assert(!b.free && b.control)
        },
        check("AL-05, B-41: emulation copies, raises nothing and stays open") { b =>
          def copies = b.dut.copyControl.peek().litToBoolean
          b.dut.emulation.poke(true)
          assert(!copies)
          b.step(b.dut.alControlWritten)
          assert(copies && b.free && !b.control, "when the register has its new value")
          b.step()
          assert(!copies)
          b.dut.emulation.poke(false)
          b.step(b.dut.alControlWritten)
          assert(!copies && !b.free)
          b.dut.emulation.poke(true)
          assert(b.free)
        },
        check("IRQ-02, IRQ-08: where each event stands") { b =>
          b.dut.smEcatEvents.poke(0x15)
          b.dut.smAlEvents.poke(0x0a)
          assert(b.dut.ecatEvents.peek().litValue == 0x0150)
          assert(b.dut.alEvents.peek().litValue == 0x0a00)
          for (bit <- 0 until 5) {
            b.dut.smChanged.poke(1 << bit)
            assert(b.dut.alEvents.peek().litValue == 0x0a10)
          }
          b.dut.smChanged.poke(0)
          b.dut.watchdog.poke(true)
          assert(b.dut.alEvents.peek().litValue == 0x0a40)
          b.step(b.dut.alControlWritten)
          assert(b.dut.alEvents.peek().litValue == 0x0a41)
        },
        check("IRQ-01, IRQ-08, B-43: each event alone, and its mask alone") { b =>
          b.dut.alStatus.poke(2)
          b.dut.dlStatus.poke(2)
          b.dut.smEcatEvents.poke(0x1f)
          b.dut.smAlEvents.poke(0x1f)
          b.dut.smChanged.poke(1)
          b.dut.watchdog.poke(true)
          b.step(b.dut.alControlWritten)
          assert(b.dut.irqField.peek().litValue == 0 && !b.dut.irq.peek().litToBoolean)
          for (bit <- 0 until 16) {
            b.dut.ecatMask.poke(1 << bit)
            assert(b.dut.irqField.peek().litValue == (if (bit >= 2 && bit < 9) 1 << bit else 0), bit)
          }
          for (bit <- 0 until 13) {
            b.dut.alMask.poke(1 << bit)
            assert(b.dut.irq.peek().litToBoolean == (Seq(0, 4, 6).contains(bit) || bit >= 8), bit)
          }
        }
      ): _*
  )

  together("twelve SyncManagers", new Application(p.copy(syncManagers = 12)))(
    check("IRQ-02, IRQ-08: the master sees eight SyncManagers, the host all") { b =>
      b.dut.smEcatEvents.poke(0xa5a)
      b.dut.smAlEvents.poke(0xa5a)
      assert(b.dut.ecatEvents.peek().litValue == 0x05a0)
      assert(b.dut.alEvents.peek().litValue == 0xa5a00)
    }
  )
}
