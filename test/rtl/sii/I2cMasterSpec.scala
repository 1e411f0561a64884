package flyframe.sii

import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation

/** Rules SII-16 to SII-20: one command at a time on the two lines. */
class I2cMasterSpec extends AnyFlatSpec with SharedSimulation {
  import BusEvent._

  private class Bench(dut: I2cMaster) extends Assertions {
    val eeprom         = new I2cEeprom(Array.tabulate(256)(i => (i * 91 + 7) & 0xff), false)
    var done           = false
    def scl: Boolean   = !dut.sclLow.peekBoolean()
    def sda: Boolean   = !dut.sdaLow.peekBoolean()
    def ready: Boolean = dut.command.ready.peekBoolean()
    def step(): Unit = {
      eeprom.step(scl, sda && !eeprom.pulls)
      dut.sda.poke(sda && !eeprom.pulls)
      done = dut.done.peekBoolean()
      if (done) assert(!ready)
      dut.clock.step()
    }

    /** Does a command; the byte read and whether a byte was acknowledged. */
    def run(command: I2cCommand.Type, byte: Int = 0): (Int, Boolean) = {
      assert(ready)
      dut.command.valid.poke(true)
      dut.command.bits.poke(command)
      dut.data.poke(byte)
      step()
      dut.command.valid.poke(false)
      dut.data.poke(~byte & 0xff)
      var result = (0, false)
      var waited = 0
      do {
        if (dut.done.peekBoolean())
          result = (dut.received.peekInt().toInt, dut.acknowledged.peekBoolean())
        step()
        waited += 1
        assert(waited < 10000, "never done")
      } while (!done)
      result
    }
    dut.command.valid.poke(false)
    dut.sda.poke(true)
  }
  private def check(name: String)(run: Bench => Unit): (String, I2cMaster => Unit) =
    name -> (dut => run(new Bench(dut)))

  for (quarter <- Seq(1, 5))
    together(s"$quarter cycles a quarter", new I2cMaster(quarter))(
      check("SII-16: the lines are free after reset and between transfers") { b =>
        for (_ <- 0 until 50) { assert(b.scl && b.sda && b.ready); b.step() }
        b.run(I2cCommand.start)
        b.run(I2cCommand.stop)
        for (_ <- 0 until 50) { assert(b.scl && b.sda); b.step() }
        assert(b.eeprom.log == Seq(Start, Stop))
      },
      check("SII-18: every byte value arrives, most significant bit first, acknowledged") { b =>
        b.run(I2cCommand.start)
        assert(b.run(I2cCommand.write, 0xa0)._2)
        for (byte <- 0 to 0xff) assert(b.run(I2cCommand.write, byte)._2, byte)
        b.run(I2cCommand.stop)
        assert(b.eeprom.log == Seq(Start, Written(0xa0)) ++ (0 to 0xff).map(Written(_)) :+ Stop)
      },
      check("SII-19: bytes are read; acknowledge after all but the last") { b =>
        b.run(I2cCommand.start)
        b.run(I2cCommand.write, 0xa0)
        b.run(I2cCommand.write, 0x10)
        b.run(I2cCommand.start)
        assert(b.run(I2cCommand.write, 0xa1)._2)
        val read = (0 until 200).map(_ => b.run(I2cCommand.read)._1) :+ b.run(I2cCommand.readLast)._1
        b.run(I2cCommand.stop)
        val sent = (0 to 200).map(i => b.eeprom.content(0x10 + i))
        assert(read == sent)
        assert(
          b.eeprom.log == Seq(Start, Written(0xa0), Written(0x10), Start, Written(0xa1)) ++
            sent.init.map(Read(_)) ++ Seq(Read(sent.last, acknowledged = false), Stop)
        )
      },
      check("SII-15: a byte that is not acknowledged is told") { b =>
        b.run(I2cCommand.start)
        assert(!b.run(I2cCommand.write, 0x50)._2, "not its address")
        b.run(I2cCommand.stop)
        b.run(I2cCommand.start)
        assert(b.run(I2cCommand.write, 0xa0)._2)
        b.eeprom.isAbsent = true
        assert(!b.run(I2cCommand.write, 0x00)._2)
        b.run(I2cCommand.stop)
      },
      check("SII-20: a bit takes four quarters, data moves one quarter behind the falling clock") { b =>
        b.run(I2cCommand.start)
        b.run(I2cCommand.write, 0xa5)
        b.run(I2cCommand.stop)
        val e     = b.eeprom
        val rises = e.rises.take(9)
        assert(rises.zip(rises.drop(1)).forall { case (x, y) => y - x == 4 * quarter })
        assert(e.races == 0)
        assert(e.falls.slice(1, 9).zip(rises).forall { case (f, r) => f - r == 2 * quarter })
        // All changes are the master's but those of the acknowledge, which the EEPROM makes at once.
        val acknowledge = e.falls.slice(8, 10).flatMap(f => Seq(f + 1, f + quarter))
        // From one command to the next it takes two cycles, however short a quarter is.
        val between = Seq(e.falls.head, e.falls(9))
        for (c <- e.changes if !acknowledge.contains(c); f <- e.falls.filter(_ < c).lastOption)
          assert(c - f == (if (between.contains(f)) quarter max 2 else quarter))
      }
    )
}
