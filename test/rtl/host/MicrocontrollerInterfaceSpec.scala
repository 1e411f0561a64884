package flyframe.host

import chisel3._
import chisel3.util._
import chiseltest._
import org.scalatest.Assertions
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.SharedSimulation
import flyframe.params.EscParams

/** The interface in front of a memory that takes its time, with what is at the port. */
class MicrocontrollerUnderTest(p: EscParams, latency: Int) extends Module {
  private val interface = Module(new MicrocontrollerInterface(p))
  private val memory    = Module(new PortMemory(p.lanes, latency))
  memory.port <> interface.port
  interface.side.events := 0.U
  val pins = IO(new MicrocontrollerPins(p.lanes))
  pins <> interface.bus
  val error = IO(Output(Valid(UInt(16.W))))
  error := interface.side.error
  val access = IO(Output(Valid(new Bundle {
    val write   = Bool()
    val address = UInt(16.W)
    val be      = UInt(p.lanes.W)
  })))
  access.valid        := memory.port.ack
  access.bits.write   := memory.port.write
  access.bits.address := memory.port.addr
  access.bits.be      := memory.port.be
}

class MicrocontrollerInterfaceSpec extends AnyFlatSpec with SharedSimulation {
  private val latency = 12

  private class Host(dut: MicrocontrollerUnderTest, p: EscParams) extends Assertions {
    private val pins = dut.pins
    val random       = new scala.util.Random(1)
    val all          = (1 << p.lanes) - 1
    var log          = Vector.empty[(Boolean, Int, Int)]
    var errors       = Vector.empty[Int]
    private def strobes(read: Boolean, write: Boolean): Unit = {
      pins.cs_n.poke(!(read || write))
      pins.rd.poke(read == (p.busReadHigh == 1))
      pins.wr_n.poke(!write)
    }
    def step(cycles: Int = 1): Unit = for (_ <- 0 until cycles) {
      if (dut.access.valid.peekBoolean())
        log :+= ((
          dut.access.bits.write.peekBoolean(),
          dut.access.bits.address.peekInt().toInt,
          dut.access.bits.be.peekInt().toInt
        ))
      if (dut.error.valid.peekBoolean()) errors :+= dut.error.bits.peekInt().toInt
      dut.clock.step()
    }
    def busy: Boolean = {
      val (level, drive)  = (pins.busy.peekBoolean(), pins.busy_drive.peekBoolean())
      assert(drive || p.busBusyDriver  % 2 == 1)
      assert(!drive || p.busBusyDriver % 2 == 0 || level == (p.busBusyDriver == 3))
      drive && level == p.busBusyDriver >= 2
    }
    def enables(be: Int): Unit = pins.be.poke(if (p.busByteEnableHigh == 1) be else ~be & all)
    strobes(read = false, write = false)
    enables(0)
    forget()

    /** Begins an access, and ends it. */
    def begin(write: Boolean, word: Int, data: BigInt = 0, be: Int = all): Unit = {
      pins.a.poke(word)
      enables(be)
      pins.d_in.poke(data)
      strobes(!write, write)
      pins.d_drive.expect(!write)
    }
    def end(): Unit = {
      strobes(read = false, write = false)
      step()
      // What stood at the pins may go.
      pins.a.poke(random.nextInt(0x1000))
      enables(random.nextInt(all + 1))
      pins.d_in.poke(random.nextInt(0x100))
      step(3)
    }
    def access(write: Boolean, word: Int, data: BigInt = 0, be: Int = all): BigInt = {
      begin(write, word, data, be)
      step(6)
      var waited = 0
      while (busy) {
        step()
        waited += 1
        assert(waited < 100, "BUSY does not end")
      }
      val result = pins.d_out.peekInt()
      end()
      result
    }
    def change(data: BigInt): Unit = pins.d_in.poke(data)
    def read(word: Int): BigInt    = access(write = false, word)

    /** All has happened. */
    def settle(): Unit = step(40)
    def forget(): Unit = {
      settle()
      log = Vector.empty
      errors = Vector.empty
    }
  }

  for (
    p <- Seq(
      EscParams(),
      EscParams(dataBusWidth = 16, busBusyDriver = 1, busReadHigh = 1),
      EscParams(dataBusWidth = 32, busWriteEarly = 1, busBusyDriver = 2, busReadDelay = 3),
      EscParams(dataBusWidth = 16, busWriteEarly = 1, busBusyEarly = 1, busByteEnableHigh = 1, busReadAll = 1)
        .copy(busBusyDriver = 3)
    ).map(_.copy(hostInterface = 5))
  ) {
    val early = p.busWriteEarly == 1
    def word(i: Int): BigInt =
      BigInt("9e3779b97f4a7c15", 16) * (i + 1) >> 7 & (BigInt(1) << p.dataBusWidth) - 1
    def check(name: String)(run: Host => Unit) =
      name -> { dut: MicrocontrollerUnderTest => run(new Host(dut, p)) }
    val title = s"${p.dataBusWidth} bits, ${if (early) "early" else "late"} writes, driver ${p.busBusyDriver}"
    together(title, new MicrocontrollerUnderTest(p, latency))(
      check("B-117: accesses that follow each other are carried out once, each with its own data") { h =>
        for (i <- 0 until 64) h.access(write = true, i, word(i))
        for (i <- 0 until 64) assert(h.read(i) == word(i))
        for (i <- 0 until 64; w = h.random.nextInt(64)) {
          if (h.random.nextBoolean()) h.access(write = true, w, word(w)) else assert(h.read(w) == word(w))
          h.step(h.random.nextInt(4))
        }
        h.settle()
        assert((h.log.size, h.errors) == ((192, Vector.empty)))
      },
      check("B-117: bytes that are not enabled are left alone") { h =>
        for (be <- 1 to h.all) {
          h.access(write = true, 5, 0)
          h.access(write = true, 5, (BigInt(1) << p.dataBusWidth) - 1, be)
          val expected =
            (0 until p.lanes).map(i => if ((be >> i & 1) == 1) BigInt(0xff) << 8 * i else BigInt(0)).sum
          assert(h.read(5) == expected)
          h.forget()
          h.access(write = false, 5, be = be)
          h.settle()
          assert(h.log == Seq((false, 5 * p.lanes, if (p.busReadAll == 1) h.all else be)))
        }
      },
      check("B-116: an access without an enabled byte does nothing, and is counted") { h =>
        for (write <- Seq(true, false) if write || p.busReadAll == 0) {
          h.forget()
          h.access(write, 5, be = 0)
          h.settle()
          assert(h.log.isEmpty && h.errors == Seq(if (write) 8 else 4))
        }
        h.access(write = true, 6, word(6))
        assert(h.read(6) == word(6))
      },
      check(
        "B-116, B-117: an access that its host ends too early is carried out once, and no other is hurt"
      ) { h =>
        for (i      <- 0 until 64) h.access(write = true, i, word(i))
        for (cycles <- 1 to 20; gap <- 3 to 5) {
          h.forget()
          h.begin(write = false, 9)
          h.step(cycles)
          val ended = h.busy
          h.end()
          h.step(gap - 3)
          assert(h.read(cycles) == word(cycles), s"behind a read of $cycles cycles")
          h.settle()
          val both = Seq((false, 9 * p.lanes, h.all), (false, cycles * p.lanes, h.all))
          // It is counted if it was carried out before it had an answer.
          if (!ended) assert((h.log, h.errors) == ((both, Vector.empty)))
          else if (h.log == both) assert(h.errors == Seq(1) || h.errors.isEmpty && cycles > latency)
          else assert((h.log, h.errors) == ((both.tail, Vector.empty)) && cycles < 5)
        }
      },
      check("B-117: a write is that of its last moment, and one that is carried out holds the next access") {
        h =>
          if (!early) {
            h.begin(write = true, 7, 0)
            h.step(8)
            assert(!h.busy, "its host need not wait")
            h.change(word(7))
            h.step(2)
            h.end()
            h.begin(write = true, 8, word(8))
            h.step(3)
            assert(h.busy)
            while (h.busy) h.step()
            h.step(6)
            h.end()
            assert(h.read(7) == word(7) && h.read(8) == word(8))
            // One that does not look at BUSY is lost, and counted.
            h.forget()
            h.access(write = true, 7, 0)
            h.begin(write = true, 8, 0)
            h.step(5)
            h.end()
            h.settle()
            assert(h.log.size == 1 && h.errors == Seq(2))
            assert(h.read(8) == word(8))
            h.forget()
            h.access(write = true, 7, word(7))
            h.begin(write = false, 8)
            h.step(5)
            h.end()
            h.settle()
            assert(h.log.size == 1 && h.errors == Seq(1), "a read")
          }
      },
      check("B-117: glitches of the strobes begin nothing") { h =>
        h.forget()
        for (_ <- 0 until 20) {
          h.begin(h.random.nextBoolean(), 3)
          h.step()
          h.end()
          h.step(h.random.nextInt(6))
        }
        h.settle()
        assert(h.log.isEmpty && h.errors.isEmpty)
        h.access(write = true, 3, word(3))
        assert(h.read(3) == word(3))
      }
    )
  }
}
