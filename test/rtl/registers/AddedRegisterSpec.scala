package flyframe.registers

import scala.util.Random
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{ControllerUnderTest, RtlBench, SharedSimulation, SlaveController}
import flyframe.memory.{RegisterBus, RegisterUnit}
import flyframe.model.{Datagram, EscModel, EtherCatFrame, ModelUnit}
import flyframe.params.{EscParams, Presets}
import flyframe.protocol.Command._
import flyframe.rules.{Bench, ModelBench, Rules, Steps}
import RegisterTable._

/** The registers of a product with a bell, in the place that the units leave free. */
object BellRegisters {
  val Bell = 0x0f20
  val Text = 0x0f10

  // format: off
  val all: Seq[Register] = Seq(
    register(Bell, 2, "bell", rw, ack, "GEN-04", "Bell",
      field("bell_tone", 7, 0, stored, 0, "The bus rings by writing it"),
      field("bell_rung", 8, 8, status, 0, "1: the bus rang since the host read a byte of this register")),
    register(Text, 8, "bell_text", rw, r, "SM-26", "Text", // in front of the bell, for SyncManagers
      field("bell_text", 63, 0, stored, 0, "Who rings")).copy(managed = true)
  )
  // format: on
}

/** The unit behind them: drives the field that is not storage. */
class Bell extends RegisterUnit(BellRegisters.all) {
  def connect(bus: RegisterBus): Unit =
    bus.status("bell_rung") := bus.untilAcknowledged("bell")(bus.written("bell_tone").valid)
}

/** The same in the golden model. */
class BellModel extends ModelUnit {
  private var rung = false
  override def status(field: String): Option[Int] =
    Option.when(field == "bell_rung")(if (rung) 1 else 0)
  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit =
    if (address == BellRegisters.Bell) rung = true
  override def acknowledged(register: Register, address: Int): Unit =
    if (register.name == "bell") rung = false
}

/** What the bell does, on RTL and model. */
object BellRules extends Rules {
  import BellRegisters.{Bell, Text}
  private val Outputs               = DigitalOutputRegisters.Outputs
  private def managed(p: EscParams) = p.syncManagers > 0
  private def bits(p: EscParams)    = p.hasBitWrites

  rule("the bus rings, the host hears it once") { s =>
    import s._
    assert(get(Bell, 2).contains(Seq(0, 0)) && hostGet(Bell, 2) == Seq(0, 0), "after reset")
    assert(one(Datagram(Apwr, 0, Bell, Seq(0x5a))).workingCounter == 1)
    assert(get(Bell, 2).contains(Seq(0x5a, 1)), "the bus sees that it rang")
    assert(get(Bell, 2).contains(Seq(0x5a, 1)), "reading from the bus changes nothing")
    assert(bench.hostRead(Bell + 1) == 1, "the host hears it")
    assert(bench.hostRead(Bell + 1) == 0 && get(Bell, 2).contains(Seq(0x5a, 0)), "and that ended it")
    bench.hostWrite(Bell, 1)
    spoiled(Datagram(Apwr, 0, Bell, Seq(2)))
    assert(get(Bell, 3).contains(Seq(0x5a, 0, 0)), "neither the host nor a bad frame rings")
    assert(get(Bell + 2, 2).isEmpty && !put(Bell + 2, 1), "behind it there is nothing")
  }
  rule("a SyncManager over the outputs, the text and the bell acts on all but the bell", managed) { s =>
    import s._
    syncManager(0, Outputs, 0x40, 0) // the bus reads
    assert(!put(Outputs, 1) && !put(Text, 1), "the bus does not write there")
    assert(put(Bell, 3) && bench.hostRead(Bell) == 3 && get(Bell, 2).contains(Seq(3, 0)))
  }
  rule("the text has a buffer of its own, the third one would be the bell and does not exist", managed) { s =>
    import s._
    def text(byte: Int) = put(Text, Seq.fill(8)(byte): _*)
    assert(put(Bell, 7))
    syncManager(0, Text, 8, 4) // the bus writes
    assert(text(1) && hostGet(Text, 8) == Seq.fill(8)(1), "first buffer: the register itself")
    for (i <- 2 to 7) {
      text(i)
      hostGet(Text, 8)
    }
    assert(get(Bell, 2).contains(Seq(7, 1)))
  }
  rule("an FMMU writes single bits of the outputs, whole bytes of the bell", bits) { s =>
    import s._
    assert(put(Outputs, 0xff) && put(Bell, 0xff))
    fmmu(0, 0x100, 1, (2, 4, 2), Outputs, 2)
    fmmu(1, 0x200, 1, (2, 4, 2), Bell, 2)
    assert(logical(Lwr, 0x100, 0).workingCounter == 1 && logical(Lwr, 0x200, 0).workingCounter == 1)
    assert(get(Outputs, 1).contains(Seq(0xe3)) && get(Bell, 1).contains(Seq(0)))
  }
}

/** A register at 0x0F20 that a product adds, with an effect when the host reads it, as `CONTRIBUTING.md` says
  * how: it behaves alike in RTL and model, with the digital outputs, which SyncManagers act on, in front of
  * it and without.
  */
class AddedRegisterSpec extends AnyFlatSpec with SharedSimulation {
  import BellRegisters.{Bell, Text}

  private val plain = Presets.named("cyclone4-min").get.params
  private val outputs = plain.copy(
    preset = "outputs",
    fmmus = 2,
    fmmuBitwise = 1,
    syncManagers = 2,
    applicationLayer = 1,
    watchdogs = 1,
    digitalOutputs = 4
  )
  private val wide = outputs.copy(preset = "outputs-wide", dataBusWidth = 32, fmmuBitwise = 0)

  private def model(p: EscParams) =
    new ModelBench(p, controller = new EscModel(_, None, BellRegisters.all, Seq(new BellModel)))

  /** Anything that is done around these addresses comes to the same on both. */
  private def random(seed: Int, count: Int)(rtl: Bench): Unit = {
    val p             = rtl.p
    val model         = this.model(p)
    val draw          = new Random(seed)
    def address()     = DigitalOutputRegisters.Outputs + draw.nextInt(0x30)
    def managed()     = if (draw.nextInt(3) == 0) address() else if (draw.nextBoolean()) Text else Bell - 4
    def bytes(n: Int) = Seq.fill(n)(draw.nextInt(256))
    for (i <- 1 to count) {
      def same[T](what: String)(f: Bench => T): Unit = {
        val (expected, got) = (f(model), f(rtl))
        assert(got == expected, s"seed $seed, step $i: $what")
      }
      def bus(d: Datagram) = same(d.toString)(b => new Steps(b).send(EtherCatFrame(Seq(d))))
      draw.nextInt(12) match {
        case 0 if rtl.p.syncManagers > 0 =>
          val (n, start, length, control) =
            (
              0x0800 + 8 * draw.nextInt(2),
              managed(),
              1 + draw.nextInt(12),
              4 * draw.nextInt(2) + 2 * draw.nextInt(2)
            )
          bus(Datagram(Apwr, 0, n + SyncManagerRegisters.Activate, Seq(0)))
          bus(Datagram(Apwr, 0, n, Seq(start & 0xff, start >> 8, length, 0, control, 0, 1)))
        case 1 | 2 | 3 =>
          val a = managed()
          bus(Datagram(Apwr, 0, a, bytes(1 + draw.nextInt(12))))
        case 4 | 5 => bus(Datagram(Apwr, 0, Text, bytes(8)))
        case 6 =>
          val a = managed()
          bus(Datagram(Aprd, 0, a, Seq.fill(1 + draw.nextInt(40))(0)))
        case 7 =>
          val (a, byte) = (address(), draw.nextInt(256))
          same(f"host writes $a%04x")(_.hostWrite(a, byte))
        case 8 | 9 => for (a <- Text until Text + 8) same(f"host reads $a%04x")(_.hostRead(a))
        case _ =>
          val a = address()
          same(f"host reads $a%04x")(_.hostRead(a))
      }
    }
  }

  for (p <- Seq(plain, outputs, wide)) {
    val rules = BellRules.all.filter(_.needs(p))
    for (rule <- rules) s"${rule.name} [${p.preset}, model]" should "hold" in rule.run(new Steps(model(p)))

    val checks = rules.map(r => r.name -> { bench: RtlBench => r.run(new Steps(bench)) }) :+
      ("random traffic is the same as on the model" -> { bench: RtlBench =>
        random(seed = 11, count = 300)(bench)
      })
    together(p.preset, new ControllerUnderTest(p, new SlaveController(_, Seq(new Bell))))(checks.map {
      case (name, check) =>
        name -> { dut: ControllerUnderTest => check(new RtlBench(dut, p)) }
    }: _*)
  }
}
