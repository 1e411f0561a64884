package flyframe.host

import org.scalatest.flatspec.AnyFlatSpec
import scala.util.Random
import flyframe.model.{Datagram, EtherCatFrame, Fcs, WireFrame}
import flyframe.params.EscParams
import flyframe.protocol.Command._
import flyframe.rules.{Bench, ModelBench}
import flyframe.{ControllerUnderTest, RtlBench, SharedSimulation, TestSets}

/** Digital I/O without a host at random: the RTL does what the golden model does, frame by frame and pin by
  * pin (B-118).
  */
class DigitalRandomSpec extends AnyFlatSpec with SharedSimulation {
  private val steps = 1500

  /** Something that is done to a bench; what it tells. */
  private type Act = Bench => Any

  private class Traffic(p: EscParams, random: Random) {
    private def bytes(n: Int)        = Seq.fill(n)(random.nextInt(0x100))
    private def word(value: Int)     = EtherCatFrame.little(value)
    private def oneOf[A](all: A*): A = all(random.nextInt(all.size))

    private def datagram(): Datagram = random.nextInt(10) match {
      case 0 | 1 | 2 =>
        val at = random.nextInt(p.digitalOutputs + 1)
        Datagram(oneOf(Apwr, Bwr, Aprw), 0, 0x0f00 + at, bytes(1 + random.nextInt(4)))
      case 3     => Datagram(Aprd, 0, 0x0f00, Seq.fill(4)(0))
      case 4 | 5 => Datagram(oneOf(Aprd, Brd), 0, 0x1000, Seq.fill(1 + random.nextInt(4))(0))
      case 6     => Datagram(Apwr, 0, 0x0120, word(oneOf(8, 8, 8, 4, 0x18, 1)))
      case 7     => Datagram(Aprd, 0, oneOf(0x0130, 0x0140, 0x0200, 0x0440, 0x0800, 0x0820), Seq.fill(8)(0))
      case 8 if p.syncManagers > 0 =>
        val n      = random.nextInt(p.syncManagers)
        val inputs = n == p.digitalOutputs
        val content = word(if (inputs) 0x1000 else 0x0f00 + n) ++ word(if (inputs) p.digitalInputs else 1) ++
          Seq(if (inputs) 0 else oneOf(0x44, 0x44, 0x04), 0, oneOf(1, 1, 0))
        Datagram(Apwr, 0, 0x0800 + 8 * n, content)
      case 8                => Datagram(Apwr, 0, 0x1000 + random.nextInt(8), bytes(2))
      case _ if p.fmmus > 0 => Datagram(oneOf(Lrw, Lwr, Lrd), 0, random.nextInt(8), bytes(4))
      case _                => Datagram(Nop, 0, 0, Seq(0))
    }

    def act(): Act = random.nextInt(20) match {
      case 0 =>
        val level = random.nextInt(4) > 0
        _.setOutputEnable(level)
      case 1 =>
        val loaded = random.nextInt(4) > 0
        _.setLoaded(loaded)
      case 2 | 3 =>
        val levels = random.nextInt()
        _.setDigitalInputs(levels)
      case 4 if random.nextInt(8) == 0 => _.advanceMs(12) // the watchdog expires
      case _ =>
        val content = EtherCatFrame(Seq.fill(1 + random.nextInt(3))(datagram()))
        val frame =
          if (random.nextInt(8) > 0) WireFrame.withFcs(content)
          else WireFrame.ofBytes(content ++ Fcs.of(content).map(_ ^ 0xff))
        _.send(0, frame)
    }

    /** 10 ms for the watchdog, far more than some frames take, and process data at logical addresses. */
    def begin: Seq[Act] = {
      def put(address: Int, data: Int*): Act =
        _.send(0, WireFrame.withFcs(EtherCatFrame(Seq(Datagram(Apwr, 0, address, data)))))
      def fmmu(n: Int, physical: Int, kind: Int) =
        put(0x0600 + 16 * n, Seq(0, 0, 0, 0, 4, 0, 0, 7) ++ word(physical) ++ Seq(0, kind, 1, 0, 0, 0): _*)
      put(0x0420, 100, 0) +: (if (p.fmmus > 1) Seq(fmmu(0, 0x0f00, 2), fmmu(1, 0x1000, 1)) else Nil)
    }
  }

  for (p <- TestSets.digital.filter(p => Set("digital", "digital-min")(p.preset)))
    together(p.preset, new ControllerUnderTest(p))(
      "B-118: outputs, inputs and frames at random are those of the model" -> { dut =>
        val (rtl, model)  = (new RtlBench(dut, p), new ModelBench(p))
        val random        = new Random(7)
        val traffic       = new Traffic(p, random)
        var shown, hidden = 0
        def both(act: Act, name: String): Unit = {
          val (is, wanted) = (act(rtl), act(model))
          assert(is == wanted, name)
          assert(rtl.outputs == model.outputs, name)
          if (model.outputs.isDefined) shown += 1 else hidden += 1
        }
        for (act  <- traffic.begin) both(act, "beginning")
        for (step <- 0 until steps) both(traffic.act(), s"step $step")
        assert(shown > steps / 10 && hidden > steps / 10)
      }
    )
}
