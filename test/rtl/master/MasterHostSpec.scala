package flyframe.master

import scala.util.Random
import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.ethernet.NetworkSettings
import flyframe.SharedSimulation
import flyframe.memory.HostPort
import flyframe.params.{EscParams, Presets}
import flyframe.protocol.ServerDatagram
import flyframe.registers.{Field, MasterRegisters, RegisterMap, Source}
import org.scalatest.flatspec.AnyFlatSpec

/** The registers of a master with nothing around them that would change one. */
class MasterHostBench(p: EscParams) extends Module {
  private val registers = Module(new MasterHost(p))
  private val settings  = Module(new NetworkSettings(2))
  val host              = IO(new HostPort(p.lanes))
  val value             = IO(chiselTypeOf(registers.value))
  val status            = IO(chiselTypeOf(registers.status))

  /** A unit that reads settings. */
  val readAddress = IO(Input(UInt(NetworkSettings.AddressBits.W)))
  val readData    = IO(Output(UInt(8.W)))
  registers.host <> host
  value                 := registers.value
  registers.status      := status
  registers.set         := 0.U.asTypeOf(registers.set)
  registers.event       := 0.U.asTypeOf(registers.event)
  settings.write        := registers.settingWrite
  settings.writeAddress := registers.settingAddress
  settings.writeData    := registers.settingData
  settings.readAddress  := VecInit(registers.settingAddress, readAddress)
  registers.setting     := settings.readData(0)
  readData              := settings.readData(1)

  /** How often a unit was told of an expected node, and of which one the last time. */
  val told          = IO(Output(UInt(8.W)))
  val heard         = IO(Output(UInt(16.W)))
  private val pulse = registers.writes(MasterRegisters.ExpectedNode + 1)
  told  := Counter(pulse, 256)._1
  heard := RegEnable(value.uint("expected_node"), pulse)
}

class MasterHostSpec extends AnyFlatSpec with SharedSimulation {
  private class Host(dut: MasterHostBench, p: EscParams, random: Random) {
    private val registers = RegisterMap(p)

    /** Values of all fields, and what a read of a byte gives by them. */
    private val values = registers.flatMap(_.fields).map(f => f.name -> f.reset).to(collection.mutable.Map)
    private def expected(address: Int): Int = registers.find(_.covers(address)).fold(0) { r =>
      val whole = r.fields.map(f => values(f.name) << f.low).sum
      (whole >> (8 * (address - r.address)) & 0xff).toInt
    }
    private def any(f: Field) = BigInt(f.width, random)
    private def isKey(address: Int) =
      address >= MasterRegisters.MasterKey && address < MasterRegisters.MasterKey + ServerDatagram.KeyBytes

    for (f <- registers.flatMap(_.fields) if f.source == Source.Status) {
      values(f.name) = any(f)
      dut.status.uint(f.name).poke(values(f.name).U)
    }
    dut.host.req.poke(false)

    /** Cycles until the acknowledgement of an access, and what was read. */
    def access(address: Int, isWrite: Boolean, data: BigInt, lanes: Int): (Int, BigInt) = {
      dut.host.addr.poke(address)
      dut.host.write.poke(isWrite)
      dut.host.wdata.poke(data)
      dut.host.be.poke(lanes)
      dut.host.req.poke(true)
      var cycles = 0
      while (!dut.host.ack.peekBoolean()) {
        dut.clock.step()
        cycles += 1
        assert(cycles < 300, "no acknowledgement")
      }
      val result = dut.host.rdata.peekInt()
      dut.clock.step()
      dut.host.req.poke(false)
      dut.clock.step()
      (cycles, result)
    }

    /** Writes a word of any data, any bytes of it. */
    def write(address: Int): Unit = {
      val data  = BigInt(8 * p.lanes, random)
      val lanes = random.nextInt(1 << p.lanes)
      access(address, isWrite = true, data, lanes)
      for {
        i <- 0 until p.lanes if (lanes >> i & 1) == 1
        r <- registers.find(_.covers(address + i))
        f <- r.fields if r.pdi.writable && (f.source == Source.Ram || f.source.isInstanceOf[Source.Stored])
      } {
        val written = (BigInt(0xff) << (8 * (address + i - r.address)) & f.mask) >> f.low
        val value   = (data >> (8 * i) & 0xff) << (8 * (address + i - r.address)) >> f.low
        values(f.name) = (values(f.name) &~ written) | (value & written)
      }
    }
    def writeAll(): Unit = for (_ <- 1 to 3) random.shuffle((0 until 0x100 by p.lanes).toList).foreach(write)

    def reset(): Unit = {
      dut.reset.poke(true.B)
      dut.clock.step()
      dut.reset.poke(false.B)
      for (f <- registers.flatMap(_.fields) if f.source != Source.Status) values(f.name) = f.reset
    }

    /** All registers read as they should, units see the same, and there is nothing elsewhere. */
    def check(): Unit = {
      for (a <- (0 until 0x100 by p.lanes)) {
        val (cycles, read) = access(a, isWrite = false, 0, (1 << p.lanes) - 1)
        val wanted = (0 until p.lanes).map(i => BigInt(if (isKey(a)) 0 else expected(a + i)) << (8 * i)).sum
        assert(read == wanted && cycles <= p.lanes + 1, f"at 0x$a%02x")
      }
      for (f <- registers.flatMap(_.fields)) f.source match {
        case _: Source.Stored => assert(dut.value.uint(f.name).peekInt() == values(f.name), f.name)
        case _                =>
      }
      for (r <- registers if r.inRam; a <- r.range) {
        dut.readAddress.poke(a)
        dut.clock.step()
        assert(dut.readData.peekInt() == expected(a), f"setting 0x$a%02x")
      }
      for (a <- Seq(0x100, 0x110, 0x130, 0x1028, 0x8030)) {
        access(a, isWrite = true, BigInt(8 * p.lanes, random), (1 << p.lanes) - 1)
        assert(access(a, isWrite = false, 0, (1 << p.lanes) - 1)._2 == 0, f"at 0x$a%04x")
      }
    }
  }

  for (width <- Seq(8, 16, 32)) {
    val p = Presets.master.copy(dataBusWidth = width)
    together(s"dataBusWidth $width", new MasterHostBench(p))(
      "HOST-09: what is written is read, by the host and by the units; nothing else changes" -> { dut =>
        val host = new Host(dut, p, new Random(width))
        for (_ <- 1 to 4) {
          host.writeAll()
          host.check()
        }
      },
      "HOST-13: units read the key, the host does not" -> { dut =>
        val host = new Host(dut, p, new Random(width + 3))
        for (a <- 0xa0 until 0xb0 by p.lanes) {
          host.access(a, isWrite = true, (BigInt(1) << (8 * p.lanes)) - 1, (1 << p.lanes) - 1)
          assert(host.access(a, isWrite = false, 0, (1 << p.lanes) - 1)._2 == 0)
          dut.readAddress.poke(a)
          dut.clock.step()
          assert(dut.readData.peekInt() == 0xff)
        }
      },
      "HOST-04: halves of the time that change while they are read do not tear" -> { dut =>
        val random = new Random(width + 4)
        val host   = new Host(dut, p, random)
        for (n <- 1 to 60; half <- Seq(0, 4)) {
          // The next time is another one in every byte.
          val before = if (n % 2 == 0) BigInt(64, random) else (BigInt(1) << (8 * (1 + n % 7))) - 1
          var time   = before
          def set()  = dut.status.uint("master_time").poke(time.U)
          set()
          val parts = for (a <- half until half + 4 by p.lanes) yield {
            val read = host.access(0x98 + a, isWrite = false, 0, (1 << p.lanes) - 1)._2
            time = (time + 1 + (BigInt(1) << 32)) & ((BigInt(1) << 64) - 1)
            set()
            read << (8 * (a - half))
          }
          assert(parts.sum == (before >> (8 * half) & 0xffffffffL))
        }
      },
      "HOST-14: a unit hears of each write of an expected node, when it is there" -> { dut =>
        val host = new Host(dut, p, new Random(width + 5))
        for (n <- 1 to 40) {
          val node = BigInt(16, new Random(n))
          for (a <- 0xb8 until 0xbc by p.lanes) {
            val shift = 8 * (a - 0xba)
            val data  = if (shift >= 0) node >> shift else node << -shift
            host.access(a, isWrite = true, data & ((BigInt(1) << (8 * p.lanes)) - 1), (1 << p.lanes) - 1)
            host.access(a, isWrite = false, 0, (1 << p.lanes) - 1)
          }
          assert(dut.told.peekInt() == n && dut.heard.peekInt() == node)
        }
      },
      "HOST-10: a reset gives every register its reset value, before the host port answers" -> { dut =>
        val host = new Host(dut, p, new Random(width + 1))
        for (early <- Seq(1, 2, 60, 127, 255)) {
          host.writeAll()
          host.reset()
          dut.clock.step(early) // another reset while the first one goes on
          host.reset()
          assert(host.access(0x30, isWrite = false, 0, 1)._1 <= 270)
          host.check()
        }
      },
      "HOST-10: a write that waits for the reset comes after it" -> { dut =>
        val host = new Host(dut, p, new Random(width + 2))
        host.reset()
        host.write(0x10)
        host.writeAll()
        host.check()
      }
    )
  }
}
