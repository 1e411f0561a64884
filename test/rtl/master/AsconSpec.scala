package flyframe.master

import scala.util.Random
import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.ethernet.SettingsBench
import flyframe.SharedSimulation
import flyframe.registers.MasterRegisters
import org.scalatest.flatspec.AnyFlatSpec

/** A maker of tags with its key. */
class TagBench extends SettingsBench(1) {
  private val maker = Module(new AsconTag)
  val in            = IO(Flipped(Decoupled(UInt(8.W))))
  val over          = IO(Input(Bool()))
  val tag           = IO(Output(Valid(UInt(8.W))))
  val ready         = IO(Input(Bool()))
  settings.readAddress := VecInit(Seq(maker.settingAddress))
  maker.setting        := settings.readData(0)
  maker.granted        := true.B
  maker.tagReady       := ready
  maker.in <> in
  maker.end := over
  tag       := maker.tag
}

class AsconSpec extends AnyFlatSpec with SharedSimulation {
  private def is(b: Bool) = b.peekBoolean()

  "The model" should "give the tags that the designers give" in {
    for ((tag, size) <- AsconModel.known.zipWithIndex)
      assert(AsconModel.tag(AsconModel.knownKey, AsconModel.knownNonce, 0x30 until 0x30 + size) == tag)
    assert(AsconModel.known.size == 33)
  }

  private class Maker(dut: TagBench, random: Random) {
    var cycle            = 0
    private var came     = Vector.empty[Int]
    private var lastByte = 0

    /** Cycles from the last byte to the first one of the tag. */
    var tail = 0
    dut.in.valid.poke(false)
    dut.over.poke(false)
    dut.ready.poke(true)

    /** The tag may always come, or now and then. */
    var always = true

    def step(): Unit = {
      if (!always) dut.ready.poke(random.nextInt(8) == 0)
      if (is(dut.tag.valid)) {
        if (came.isEmpty) tail = cycle - lastByte
        came :+= dut.tag.bits.peekInt().toInt
      }
      dut.clock.step()
      cycle += 1
    }
    def key(bytes: Seq[Int]): Unit = {
      dut.port.write.poke(true)
      for ((b, i) <- bytes.zipWithIndex) {
        dut.port.address.poke(MasterRegisters.MasterKey + i)
        dut.port.data.poke(b)
        step()
      }
      dut.port.write.poke(false)
    }

    /** @param most
      *   cycles between two bytes
      */
    def tag(nonce: Seq[Int], message: Seq[Int], most: Int): Seq[Int] = {
      came = Vector.empty
      for (b <- nonce ++ message) {
        for (_ <- 1 to random.nextInt(most + 1)) step()
        dut.in.bits.poke(b)
        dut.in.valid.poke(true)
        while (!is(dut.in.ready)) step()
        lastByte = cycle
        step()
        dut.in.valid.poke(false)
        dut.in.bits.poke(random.nextInt(256))
      }
      for (_ <- 1 to random.nextInt(most + 1)) step()
      dut.over.poke(true)
      step()
      dut.over.poke(false)
      for (_ <- 1 to 900 if came.size < 16) step()
      came
    }
  }
  private def any(random: Random, bytes: Int) = Seq.fill(bytes)(random.nextInt(256))

  together("tags", new TagBench)(
    "REP-07: known answers of the standard" -> { dut =>
      val maker = new Maker(dut, new Random(1))
      maker.key(AsconModel.knownKey)
      dut.clock.step(100)
      for ((tag, size) <- AsconModel.known.zipWithIndex.tail)
        assert(maker.tag(AsconModel.knownNonce, 0x30 until 0x30 + size, most = 0) == tag, s"$size bytes")
    },
    "REP-07: any key, nonce and message, at any pace, one behind the other" -> { dut =>
      val random = new Random(2)
      val maker  = new Maker(dut, random)
      for (n <- 1 to 150) {
        maker.always = n % 5 > 0
        dut.ready.poke(true)
        val key = any(random, 16)
        maker.key(key)
        dut.clock.step(64 + random.nextInt(100))
        for (_ <- 1 to 1 + random.nextInt(3)) {
          val (nonce, message) =
            (any(random, 16), any(random, 1 + random.nextInt(if (n % 10 == 0) 500 else 70)))
          assert(maker.tag(nonce, message, Seq(0, 1, 5, 60)(n % 4)) == AsconModel.tag(key, nonce, message))
          dut.clock.step(1 + random.nextInt(10))
        }
      }
    },
    "REP-07: a block takes no longer than on the wire at 50 MHz, and a tag is soon there" -> { dut =>
      val random = new Random(3)
      val maker  = new Maker(dut, random)
      maker.key(any(random, 16))
      dut.clock.step(100)
      for (size <- 1000 to 1016) {
        val start = maker.cycle
        maker.tag(any(random, 16), any(random, size), most = 0)
        val blocks = (size + 16) / 16
        assert(
          maker.tail <= 210 && maker.cycle - start <= 16 + 12 + 72 + 48 * blocks + 72 + 100,
          s"$size bytes"
        )
      }
    }
  )
}
