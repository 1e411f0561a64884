package flyframe.dc

import chisel3._
import chiseltest._
import flyframe.memory.{StampRequest, UnitUnderTest}
import flyframe.model.TimeLoop
import flyframe.params.EscParams
import flyframe.registers.ClockRegisters

/** Distributed clocks with what ports and frame processor tell them at the pins. */
class ClocksUnderTest(val p: EscParams)
    extends UnitUnderTest(
      p,
      new DistributedClocks(
        p,
        Seq.tabulate(p.ports)(y =>
          PortActivity(
            IO(Input(Bool())).suggestName(s"receives_$y"),
            IO(Input(UInt(4.W))).suggestName(s"waited_$y"),
            true.B
          )
        ),
        IO(Input(new StampRequest)).suggestName("request"),
        Option.when(p.hasClockPins)(IO(new ClockPins(p)).suggestName("clock_signals"))
      )
    ) {

  /** SYNC and LATCH signals. */
  def pins: Option[ClockPins] = unit.pins
}

/** Bus and host of [[ClocksUnderTest]]. Local time is 0 in cycle 0, and runs at its nominal speed until a
  * time is compared.
  */
class ClockBench(val dut: ClocksUnderTest) {
  private val p     = dut.p
  private val lanes = p.lanes
  private val kept  = dut.kept.values.head
  var cycle         = 0L
  private val settings = scala.collection.mutable.Map(
    "speed_counter_start" -> 0x1000,
    "time_filter_depth"   -> 4,
    "speed_filter_depth"  -> 12
  )
  def setting(name: String): Int = settings(name)

  /** The value of a one-bit register field, as memory would give it. */
  def bit(name: String, on: Boolean): Unit = dut.value.uint(name).poke(if (on) 1 else 0)
  settings.foreach { case (name, value) => dut.value.uint(name).poke(value) }
  for (pin <- Seq(dut.registerWrite.valid, dut.begins, dut.commitStarts, dut.registersBusy, kept.host.asks))
    pin.poke(false)
  // The register RAM is cleared, FMMUs among it.
  dut.clearing.poke(true)
  for (address <- 0x0600 until 0x0700 by lanes) write(address, Seq.fill(lanes)(0))
  dut.clearing.poke(false)
  step(300)

  def step(cycles: Int = 1): Unit = {
    dut.clock.step(cycles)
    cycle += cycles
  }

  /** Bytes of a word that take effect. */
  private def write(address: Int, bytes: Seq[Int]): Unit = {
    dut.registerWrite.valid.poke(true)
    dut.registerWrite.bits.address.poke(address / lanes)
    val first = address % lanes
    dut.registerWrite.bits.mask.poke(bytes.indices.map(i => 1 << (first + i)).sum)
    dut.registerWrite.bits.data.poke(bytes.zipWithIndex.map { case (b, i) =>
      BigInt(b) << (8 * (first + i))
    }.sum)
    step()
    dut.registerWrite.valid.poke(false)
  }
  def write(address: Int, value: BigInt, count: Int): Unit =
    (0 until count).map(i => ((value >> (8 * i)) & 0xff).toInt).zipWithIndex.foreach { case (b, i) =>
      write(address + i, Seq(b))
    }
  def set(name: String, address: Int, value: Int): Unit = {
    settings(name) = value
    dut.value.uint(name).poke(value)
    write(address, Seq(0))
    settle()
  }
  def settle(): Unit = step(1500)

  /** A frame begins, reads, and writes the time of the reference clock if there is one. */
  def frame(): Unit = {
    dut.begins.poke(true)
    step()
    dut.begins.poke(false)
    step(200)
  }
  def end(time: Option[BigInt]): Unit = {
    dut.commitStarts.poke(true)
    dut.registersBusy.poke(true)
    step()
    dut.commitStarts.poke(false)
    time.foreach(write(ClockRegisters.SystemTime, _, 4))
    dut.registersBusy.poke(false)
    step(2)
  }
  private def byte(address: Int, host: Boolean): BigInt = {
    kept.address.poke(address / lanes)
    kept.host.reads.poke(host)
    step()
    kept.data.peekInt() >> (8 * (address % lanes)) & 0xff
  }
  def read(address: Int, count: Int): BigInt =
    (0 until count).map(i => byte(address + i, host = false) << (8 * i)).sum
  def hostRead(address: Int, count: Int): BigInt = (address until address + count)
    .groupBy(_ / lanes)
    .toSeq
    .sortBy(_._1)
    .flatMap { case (word, bytes) =>
      kept.host.asks.poke(true)
      kept.host.address.poke(word)
      while (!kept.host.ready.peekBoolean()) step()
      val data = bytes.map(a => byte(a, host = true) << (8 * (a - address)))
      kept.host.asks.poke(false)
      step()
      data
    }
    .sum
  def hostTime(): BigInt = hostRead(ClockRegisters.SystemTime, p.clockBytes)

  /** A frame whose reference is `difference` ns behind; with it to the model. */
  def sample(loop: TimeLoop, difference: Int): Unit = {
    frame()
    val now = read(ClockRegisters.SystemTime, 4)
    end(Some((now - difference) & 0xffffffffL))
    settle()
    loop.sample(
      difference,
      setting("speed_counter_start"),
      setting("time_filter_depth"),
      setting("speed_filter_depth")
    )
  }
  def drift(): (BigInt, BigInt) = {
    frame()
    end(None)
    (read(ClockRegisters.Difference, 4), read(0x0932, 2))
  }
}
