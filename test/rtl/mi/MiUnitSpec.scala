package flyframe.mi

import chisel3._
import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.memory.UnitUnderTest
import flyframe.params.EscParams
import flyframe.registers.MiRegisters

class MiUnitUnderTest(p: EscParams)
    extends UnitUnderTest(p, new MiUnit(p, IO(new MiPins).suggestName("pins"))) {
  val pins: MiPins = unit.pins

  /** Where link detection would be. */
  val ownAccess: Option[PhyAccess] = unit.own.map { wire =>
    val access = IO(Flipped(new PhyAccess))
    wire <> access
    access
  }
}

/** What meets a command while it waits or runs: MI-02, MI-03, MI-07, B-90 to B-92. */
class MiUnitSpec extends AnyFlatSpec with SharedSimulation {
  private val p     = EscParams(coreClockMhz = 25, mi = 2)
  private val Read  = 1
  private val Write = 2

  private class Bench(val dut: MiUnitUnderTest) extends Assertions {
    for (record <- Seq(dut.value, dut.others)) record.elements.values.foreach {
      case u: UInt => u.poke(0.U)
      case other   => fail(s"$other")
    }
    for (
      input <- Seq(
        dut.begins,
        dut.busy,
        dut.bad,
        dut.commitStarts,
        dut.registersBusy,
        dut.registerWrite.valid
      )
    ) input.poke(false)
    dut.registerWrite.bits.mask.poke(1)
    dut.pins.mdio_in.poke(true) // no PHY
    dut.clock.step()

    def shows(field: String): Int   = dut.status.uint(field).peekInt().toInt
    def may(guard: String): Boolean = dut.guard.pulse(guard).peekBoolean()
    def mdc: Boolean                = dut.pins.mdc.peekBoolean()
    def write(address: Int, byte: Int, byHost: Boolean = false): Unit = {
      dut.registerWrite.valid.poke(true)
      dut.registerWrite.bits.address.poke(address)
      dut.registerWrite.bits.data.poke(byte)
      dut.registerWriteByHost.poke(byHost)
      dut.clock.step()
      dut.registerWrite.valid.poke(false)
    }

    /** A frame begins. */
    def frame(): Unit = {
      dut.begins.poke(true)
      dut.clock.step()
      dut.begins.poke(false)
      dut.clock.step()
    }

    /** Cycles until the interface is free. */
    def untilFree(most: Int = 1200): Int = {
      var cycles = 0
      while (shows("mi_busy") == 1) {
        dut.clock.step()
        cycles += 1
        assert(cycles <= most, "busy does not end")
      }
      cycles
    }
  }

  /** The same with accesses of the controller itself, which a PHY that drives zeros answers. */
  private class OwnBench(dut: MiUnitUnderTest) extends Bench(dut) {
    val own: PhyAccess = dut.ownAccess.get
    dut.pins.mdio_in.poke(false)
    own.port.poke(1)
    own.register.poke(17)
    own.isWrite.poke(true)
    own.data.poke(0x5a3c)

    /** Cycles until the access at hand is done. */
    def untilDone(most: Int = 2400): Int = {
      var cycles = 0
      while (!own.done.peekBoolean()) {
        dut.clock.step()
        cycles += 1
        assert(cycles <= most, "the access is not done")
      }
      cycles
    }

    /** The bits that the next access drives behind its preamble: up to the turnaround, and data. */
    def driven(): Int = {
      def rise(): Unit = {
        while (mdc) dut.clock.step()
        while (!mdc) dut.clock.step()
      }
      (0 until 32).foreach(_ => rise())
      (0 until 32).foldLeft(0) { (word, _) =>
        rise()
        word << 1 | dut.pins.mdio_out.peekInt().toInt
      }
    }
  }
  private def check(name: String)(run: Bench => Unit) = name -> { dut: MiUnitUnderTest =>
    run(new Bench(dut))
  }

  together("unit", new MiUnitUnderTest(p))(
    check("B-90: a command waits for the register writes of its frame, and then runs") { b =>
      b.dut.registersBusy.poke(true)
      b.write(MiRegisters.CommandByte, Read)
      for (_ <- 0 until 100) { assert(b.shows("mi_busy") == 1 && !b.mdc); b.dut.clock.step() }
      b.dut.registersBusy.poke(false)
      assert(b.untilFree() > 1000 && b.shows("mi_read_error") == 1)
    },
    check("MI-02, B-91: what comes while a command runs is dropped, and none may be written") { b =>
      b.write(MiRegisters.CommandByte, Read)
      b.dut.clock.step(500)
      assert(!b.may("mi_ecat_may_write") && !b.may("mi_pdi_may_write") && b.shows("mi_command") == Read)
      b.write(MiRegisters.CommandByte, 7)
      b.write(MiRegisters.CommandByte, 0)
      assert(b.shows("mi_busy") == 1 && b.untilFree() < 600)
      assert(b.shows("mi_read_error") == 1 && b.shows("mi_command_error") == 0 && b.may("mi_ecat_may_write"))
    },
    check("MI-02, MI-07, B-92: what keeps ECAT off when a frame begins does so to its end") { b =>
      val guards = Seq("mi_ecat_may_write", "mi_ecat_may_claim")
      b.write(MiRegisters.CommandByte, Read)
      b.frame()
      b.untilFree()
      b.dut.clock.step(20)
      assert(guards.map(b.may) == Seq(false, true))
      b.frame()
      assert(guards.forall(b.may))
      b.write(MiRegisters.PdiAccess, 1, byHost = true)
      b.dut.clock.step()
      assert(!guards.exists(b.may), "at once")
      b.frame()
      b.write(MiRegisters.PdiAccess, 0, byHost = true)
      b.dut.clock.step(20)
      assert(!guards.exists(b.may))
      b.frame()
      assert(guards.forall(b.may))
    },
    check("MI-03: the enable ends with the next frame, and is of ECAT only") { b =>
      b.write(MiRegisters.Control, 1, byHost = true)
      b.write(MiRegisters.CommandByte, Write)
      assert(b.shows("mi_command_error") == 1)
      b.write(MiRegisters.Control, 1)
      b.frame()
      b.write(MiRegisters.CommandByte, Write)
      assert(b.shows("mi_command_error") == 1 && b.shows("mi_busy") == 0)
      b.write(MiRegisters.Control, 1)
      b.write(MiRegisters.CommandByte, Write)
      assert(b.shows("mi_command_error") == 0 && b.untilFree() > 1000)
    },
    check("MI-07, B-92: the PDI cannot take the interface while a frame is under way") { b =>
      assert(b.may("mi_pdi_may_take"))
      def frame(end: Bool): Unit = {
        b.dut.busy.poke(true)
        assert(!b.may("mi_pdi_may_take"))
        b.dut.clock.step()
        b.dut.busy.poke(false)
        for (_ <- 0 until 30) { // until its verdict, and until its writes begin to take effect
          assert(!b.may("mi_pdi_may_take"))
          b.dut.clock.step()
        }
        end.poke(true)
        b.dut.clock.step()
        end.poke(false)
      }
      frame(b.dut.bad)
      assert(b.may("mi_pdi_may_take"))
      frame(b.dut.commitStarts)
      b.dut.registersBusy.poke(true)
      assert(!b.may("mi_pdi_may_take"))
      b.dut.clock.step()
      b.dut.registersBusy.poke(false)
      b.dut.clock.step()
      assert(b.may("mi_pdi_may_take"))
      b.write(MiRegisters.PdiAccess, 1, byHost = true)
      b.dut.busy.poke(true)
      assert(b.may("mi_pdi_may_take"), "it may give it back")
    },
    check("MI-07: taken by force from a PDI whose command runs, the interface is free when that is done") {
      b =>
        b.write(MiRegisters.PdiAccess, 1, byHost = true)
        assert(b.may("mi_pdi_may_write") && !b.may("mi_ecat_may_write"))
        b.write(MiRegisters.CommandByte, Read, byHost = true)
        b.dut.clock.step(300)
        b.write(MiRegisters.PdiAccess, 2)
        b.dut.clock.step()
        assert(b.shows("mi_taken") == 0 && b.shows("mi_busy") == 1 && !b.may("mi_ecat_may_write"))
        assert(b.untilFree() < 800 && b.may("mi_ecat_may_write"))
        b.write(MiRegisters.CommandByte, Read)
        assert(b.untilFree() > 1000)
    },
    check("MI-02: a reset in the middle of a command leaves the interface free") { b =>
      b.write(MiRegisters.CommandByte, Read)
      b.dut.clock.step(700)
      b.dut.reset.poke(true.B)
      b.dut.clock.step()
      b.dut.reset.poke(false.B)
      assert(b.shows("mi_busy") == 0 && b.shows("mi_read_error") == 0 && !b.mdc)
      b.write(MiRegisters.CommandByte, Read)
      assert(b.untilFree() > 1000)
    }
  )

  /** Address of the PHY at port 1. */
  private val Second = 9
  private val linked = p.copy(miLinkDetection = 1, phyAddresses = Second << 5 | 3)

  together("own accesses", new MiUnitUnderTest(linked))(
    Seq[(String, OwnBench => Unit)](
      "MI-06, MI-10: an access of the controller goes to the PHY of its port, and is no command" -> { b =>
        b.write(MiRegisters.Address, 0x9f)
        b.write(MiRegisters.Data, 0x21)
        b.write(MiRegisters.Data + 1, 0x43)
        b.own.valid.poke(true)
        assert(b.driven() == (0x5 << 28 | Second << 23 | 17 << 18 | 2 << 16 | 0x5a3c))
        assert(b.shows("mi_busy") == 0 && b.may("mi_ecat_may_write") && b.untilDone() < 40)
        b.own.valid.poke(false)
        b.dut.clock.step(3000)
        assert(!b.mdc && b.shows("mi_data") == 0x4321, "once, and the data of commands stay")
      },
      "MI-05, MI-10: what an access of the controller reads, or that nothing answers, is for it alone" -> {
        b =>
          b.own.isWrite.poke(false)
          b.own.valid.poke(true)
          for (silent <- Seq(false, true)) {
            b.dut.pins.mdio_in.poke(silent)
            b.untilDone()
            assert(b.own.silent.peekBoolean() == silent)
            assert(b.own.answer.peekInt().toInt == (if (silent) 0xffff else 0))
            b.dut.clock.step()
            assert(b.shows("mi_read_error") == 0 && b.shows("mi_data") == 0)
          }
      },
      "MI-02, B-90, B-95: a command waits for the access that runs, and comes before the next one" -> { b =>
        b.own.valid.poke(true)
        b.dut.clock.step(500)
        b.write(MiRegisters.CommandByte, Read)
        val rest = b.untilDone()
        assert(rest > 400 && rest < 600 && b.shows("mi_busy") == 1)
        b.dut.clock.step()
        val busy = b.untilFree()
        assert(busy > 1000 && b.shows("mi_read_error") == 0 && b.shows("mi_data") == 0)
        val next = b.untilDone()
        assert(next > 1000, "then it is the controller's turn")
      },
      "MI-07, MI-10: who has the interface does not matter to accesses of the controller" -> { b =>
        b.write(MiRegisters.PdiAccess, 1, byHost = true)
        b.own.valid.poke(true)
        assert(b.untilDone() > 1000 && b.shows("mi_taken") == 1 && b.may("mi_pdi_may_write"))
        b.dut.clock.step(2)
        b.write(MiRegisters.CommandByte, Write, byHost = true)
        assert(b.untilDone() > 900 && b.shows("mi_busy") == 1)
        b.dut.clock.step()
        assert(b.untilFree() > 1000 && b.shows("mi_command_error") == 0)
      }
    ).map { case (name, run) => name -> { dut: MiUnitUnderTest => run(new OwnBench(dut)) } }: _*
  )
}
