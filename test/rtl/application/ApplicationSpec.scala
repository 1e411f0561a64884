package flyframe.application

import chisel3._
import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.memory.UnitUnderTest
import flyframe.params.EscParams
import flyframe.registers.ApplicationRegisters

class ApplicationUnderTest(p: EscParams) extends UnitUnderTest(p, new Application(p)) {
  val forDatagrams = IO(Output(UInt(16.W)))
  forDatagrams := unit.irqField
}

/** Events, and what happens when two things meet in one cycle: AL-04, AL-05, IRQ-01, IRQ-08, B-41, B-42. */
class ApplicationSpec extends AnyFlatSpec with SharedSimulation {
  private class Bench(val dut: ApplicationUnderTest) extends Assertions {
    for (record <- Seq(dut.value, dut.others, dut.reads)) record.elements.values.foreach(poke(_, 0))
    for (input  <- Seq(dut.good, dut.bad, dut.begins, dut.busy, dut.error)) input.poke(false)
    dut.registerWrite.valid.poke(false)
    dut.registerWrite.bits.mask.poke(1)
    dut.registerWrite.bits.address.poke(ApplicationRegisters.Control)
    dut.host.ack.poke(false)
    dut.host.write.poke(false)
    dut.host.be.poke(1)
    dut.host.addr.poke(ApplicationRegisters.Control)
    value("al_control", 1)
    al(1)
    dut.clock.step()

    private def poke(signal: Data, value: BigInt): Unit = signal match {
      case u: UInt => u.poke(value.U)
      case other   => fail(s"$other")
    }

    /** The stored value of a field, what another unit shows in one, and what this one does. */
    def value(field: String, value: Int): Unit  = poke(dut.value(field), value)
    def others(field: String, value: Int): Unit = poke(dut.others(field), value)
    def shows(field: String): Boolean           = dut.status.uint(field).peekInt() == 1
    def al(state: Int): Unit                    = value("al_status", state)
    def dl(state: Int): Unit = for (
      (field, bit) <- Seq("physical_link_port0" -> 2, "pdi_operational" -> 4, "pdi_watchdog" -> 8)
    ) others(field, if ((state & bit) != 0) 1 else 0)

    def written: Bool  = dut.registerWrite.valid // AL control is, read by the host
    def hostRead: Bool = dut.host.ack

    /** One cycle with these inputs high. */
    def step(high: Bool*): Unit = {
      high.foreach(_.poke(true))
      dut.clock.step()
      high.foreach(_.poke(false))
    }
    def control: Boolean = shows("al_control_event")
    def free: Boolean    = dut.guard.pulse("al_control_free").peekBoolean()
  }
  private def check(name: String)(run: Bench => Unit): (String, ApplicationUnderTest => Unit) =
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
  private val p = EscParams(syncManagers = 5, applicationLayer = 1, watchdogs = 1, sii = 1)
  together("five SyncManagers", new ApplicationUnderTest(p))(
    change("AL status event", _.shows("al_status_event"), _.al(_), _.dut.reads.pulse("al_status")) ++
      change("DL status event", _.shows("dl_status_event"), _.dl(_), _.dut.reads.pulse("dl_status")) ++ Seq(
        check("B-42: a read of one status ends the event of the other not") { b =>
          b.al(2)
          b.dl(2)
          b.step()
          assert(b.shows("al_status_event") && b.shows("dl_status_event"))
          b.step(b.dut.reads.pulse("al_status"))
          b.step(b.dut.good)
          assert(!b.shows("al_status_event") && b.shows("dl_status_event"))
          b.step(b.dut.reads.pulse("dl_status"))
          b.step(b.dut.good)
          assert(!b.shows("al_status_event") && !b.shows("dl_status_event"))
        },
        check("B-42: every bit of DL status raises the event when it changes") { b =>
          for (state <- Seq(2, 6, 14, 10, 8, 0)) {
            b.dl(state)
            b.step()
            assert(b.shows("dl_status_event"), state)
            b.step(b.dut.reads.pulse("dl_status"))
            b.step(b.dut.good)
            assert(!b.shows("dl_status_event"), state)
          }
        },
        check("AL-04, B-41: a write closes AL control until the PDI reads") { b =>
          assert(b.free && !b.control)
          b.step(b.written)
          assert(!b.free && b.control)
          b.step(b.dut.good)
          assert(!b.free && b.control)
          b.step(b.hostRead)
          assert(b.free && !b.control)
        },
        check("B-41: a write in the very cycle of the read wins, or in the one before") { b =>
          b.step(b.written)
          b.step(b.hostRead, b.written)
          assert(!b.free && b.control)
          b.step(b.hostRead)
          assert(!b.free && b.control, "the read was answered a cycle earlier")
          b.step(b.hostRead)
          assert(b.free && !b.control)
        },
        check("AL-05, B-41: emulation copies, raises nothing and stays open") { b =>
          def copies = b.dut.set.load("al_status").valid.peekBoolean()
          b.value("device_emulation", 1)
          assert(!copies)
          b.step(b.written)
          assert(copies && b.free && !b.control, "when the register has its new value")
          b.step()
          assert(!copies)
          b.value("device_emulation", 0)
          b.step(b.written)
          assert(!copies && !b.free)
          b.value("device_emulation", 1)
          assert(b.free)
        },
        check("IRQ-01, IRQ-08, B-43: each event alone, and its mask alone") { b =>
          b.al(2)
          b.dl(2)
          b.others("sm_ecat_event", 0x1f)
          b.others("sm_al_event", 0x1f)
          b.others("sm_activation_event", 1)
          b.others("watchdog_event", 1)
          b.step(b.written)
          assert(b.dut.forDatagrams.peekInt() == 0 && !b.dut.irq.peekBoolean())
          for (bit <- 0 until 16) {
            b.value("ecat_event_mask", 1 << bit)
            assert(b.dut.forDatagrams.peekInt() == (if (bit >= 2 && bit < 9) 1 << bit else 0), bit)
          }
          val masks =
            Seq("al_control_mask", "sm_activation_mask", "eeprom_mask", "watchdog_mask").map(_ -> 1) ++
              (0 until 5).map(n => "sm_mask" -> (1 << n))
          for ((mask, bit) <- masks) {
            b.value(mask, bit)
            assert(b.dut.irq.peekBoolean() == (mask != "eeprom_mask"), mask)
            b.value(mask, 0)
          }
          b.value("sm_mask", 0x0a)
          b.others("sm_al_event", 0x15)
          assert(!b.dut.irq.peekBoolean(), "other SyncManagers")
        }
      ): _*
  )

  together("twelve SyncManagers", new ApplicationUnderTest(p.copy(syncManagers = 12)))(
    check("IRQ-08: the master sees eight SyncManagers") { b =>
      b.value("ecat_event_mask", 0xffff)
      b.others("sm_ecat_event", 0xa5)
      assert(b.dut.forDatagrams.peekInt() == 0x0a50)
    }
  )
}
