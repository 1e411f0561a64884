package flyframe.ring

import java.nio.file.{Files, Paths}
import scala.collection.mutable.ArrayBuffer
import scala.jdk.CollectionConverters._
import scala.util.Random
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Directory
import flyframe.can.{CanFrame, StuffingModel}
import flyframe.fibre.model.CanRing
import flyframe.fibre.{DemodulatorModel, ModulatorModel, Reach, Tone}
import flyframe.params.FibreParams
import flyframe.relay.model.{BridgeOnEngineSpec, RelayFigures, RingLoad}
import flyframe.relay._
import flyframe.report.{Plots, RingFigure, TimingPicture, Wave}
import flyframe.transport.BusFrame
import flyframe.transport.ring.{BusModeRing, Messages, RelayModeRing, RingPort}

/** The plots of docs/ring.md are measured here, on the golden models, whose levels are those of the RTL
  * sample by sample (ModemRules). `make pictures` writes them.
  */
class RingPicturesSpec extends AnyFlatSpec {
  private val writes = sys.env.contains("FLYFRAME_PICTURES")

  private def keep(name: String, text: String): Unit = {
    val file = Paths.get("docs", name)
    if (writes) Files.writeString(file, text)
    assert(Files.readString(file) == text, "make pictures")
    ()
  }

  // ---- the modem ----

  /** What happens to light: edges early or late by up to `jitterNs`, pulses that are longer or shorter so
    * that a dominant tone has this duty cycle, pulses that are missing, a receiver whose clock is slow.
    */
  private case class Light(jitterNs: Double = 0, duty: Double = 50, lost: Double = 0, ppm: Double = 0)

  /** A modem at a bit rate. */
  private case class Modem(title: String, demodulator: Int, kbps: Int) {
    private val p        = FibreParams(demodulator = demodulator)
    private val CycleNs  = 10.0
    private val periodNs = 1000000.0 / p.toneDominantKhz
    private val bit      = p.coreClockMhz * 1000 / kbps // cycles

    /** When levels are taken: as links do above 1 Mbit/s (FR-40), else as CAN does (FR-38). */
    private val samplePoint = if (kbps > 1000) 0.65 else 0.88

    /** Times at which the light of these symbols changes. */
    private def edges(symbols: Seq[Boolean]): Seq[Double] = {
      val modulator = new ModulatorModel(p)
      val times     = ArrayBuffer.empty[Double]
      var before    = false
      for ((symbol, i) <- symbols.zipWithIndex; c <- 0 until bit) {
        modulator.step(Tone.of(symbol))
        if (modulator.light != before) {
          before = modulator.light
          times += (i * bit + c + 1) * CycleNs
        }
      }
      times.toSeq
    }

    /** Part of `count` random symbols that are heard wrongly. */
    def errors(light: Light, count: Int): Double = {
      val random  = new Random(title.hashCode ^ light.hashCode)
      val symbols = Seq.fill(count)(random.nextBoolean())
      val moved = edges(symbols)
        .grouped(2) // a pulse
        .filter(_ => random.nextDouble() >= light.lost)
        .flatMap(_.zipWithIndex.map { case (at, i) =>
          at + (random.nextDouble() * 2 - 1) * light.jitterNs + i * (light.duty - 50) / 100 * periodNs
        })
        .toArray
      // The order stays, whatever the jitter.
      for (i <- 1 until moved.length) moved(i) = moved(i) max moved(i - 1)
      val demodulator = DemodulatorModel(p)
      val step        = CycleNs * (1 + light.ppm / 1000000)
      var now         = random.nextDouble() * step
      var next        = 0
      var wrong       = 0
      for ((symbol, i) <- symbols.zipWithIndex) {
        val sampleAt = (i + samplePoint) * bit * CycleNs
        while (now < sampleAt) {
          while (next < moved.length && moved(next) <= now) next += 1
          demodulator.sample(next % 2 == 1)
          now += step
        }
        if (i > 8 && demodulator.level != symbol) wrong += 1
      }
      wrong.toDouble / (count - 9)
    }
  }

  private val Symbols = 1500
  private val Fast    = Seq(Modem("fast, 2 Mbit/s", 0, 2000), Modem("fast, 400 kbit/s", 0, 400))
  private val Counted = Seq(Modem("counting, 400 kbit/s", 1, 400), Modem("counting, 100 kbit/s", 1, 100))

  "FR-04: the counting demodulator" should "fail at 400 kbit/s over one hop, and the fast one not" in {
    assert(Fast.forall(_.errors(Light(), Symbols) == 0))
    assert(Counted.head.errors(Light(), Symbols) > 0.02)
    assert(Counted.last.errors(Light(), Symbols) == 0)
  }

  "FR-05: the fast demodulator" should "take light as bad as it may be" in
    assert(Fast.forall(m => m.errors(Light(jitterNs = 2, duty = 40), Symbols) == 0))

  "Picture docs/ring-modem.svg" should "show what light a modem takes" in {
    val panels = Seq[(String, Seq[Double], Double => Light)](
      ("jitter, ± ns", Seq(0, 2, 4, 6, 8, 10, 12, 14), v => Light(jitterNs = v)),
      ("duty cycle, %", Seq(5, 10, 20, 30, 40, 50, 60, 70, 80, 90, 95), v => Light(duty = v)),
      ("pulses lost, %", Seq(0, 1, 2, 5, 10, 15, 20, 30), v => Light(lost = v / 100)),
      ("clock error, %", Seq(0, 0.4, 1, 2, 3, 4, 5), v => Light(ppm = v * 10000))
    ).map { case (axis, values, light) =>
      axis -> (Fast ++ Counted).map(m =>
        m.title -> values.map(v => v -> m.errors(light(v), Symbols).max(1.0 / (2 * Symbols)))
      )
    }
    keep("ring-modem.svg", Plots.panels("ring-modem", "wrong symbols", panels))
  }

  // ---- a frame of relay mode ----

  private val frame  = CanFrame(0x123, extended = false, remote = false, 2, Seq(0x11, 0x22))
  private val header = LinkHeader(kind = 0, direction = 1, source = 5, sequence = 1234, LinkHeader.Hops)
  private val body   = LinkBody.of(header, frame)
  private val fields = Seq(
    "start"            -> 1,
    "kind"             -> 2,
    "direction"        -> 1,
    "source 5"         -> 7,
    "sequence 1234"    -> 14,
    "hops 255"         -> 8,
    "check"            -> 8,
    "identifier 0x123" -> 32,
    "length 2"         -> 8,
    "data 0x11 0x22"   -> 16,
    "CRC"              -> 32,
    "end"              -> LinkFrame.EndBits
  )
  private val Start = 2 // recessive bits in front

  /** Of each bit on the link the field to which it belongs, 0: none, and whether it is a stuff bit. */
  private val placed: Seq[(Int, Boolean)] = {
    val stuffing = new StuffingModel
    val levels   = LinkFrame.levels(header, body)
    val bits     = ArrayBuffer.fill(Start)((0, false))
    stuffing.begin()
    for (((_, count), i) <- fields.zipWithIndex; _ <- 0 until count) {
      bits += ((i + 1, false))
      for (level <- levels.lift(bits.size - Start - 1)) stuffing.take(level)
      if (stuffing.awaits && bits.size - Start < levels.length) {
        bits += ((i + 1, true))
        stuffing.take(levels(bits.size - Start - 1))
      }
    }
    bits.toSeq
  }
  private val sent = Seq.fill(Start)(true) ++ LinkFrame.levels(header, body) ++
    Seq.fill(LinkFrame.EndBits)(true)
  private val core    = FibreParams()
  private val bit     = core.coreClockMhz / 2 // core cycles, at 2 Mbit/s
  private val CycleNs = 1000.0 / core.coreClockMhz

  /** Light on the fibre and level heard, in each core cycle. */
  private val passed: Seq[(Boolean, Boolean)] = {
    val modulator   = new ModulatorModel(core)
    val demodulator = DemodulatorModel(core)
    for (level <- sent; _ <- 0 until bit) yield {
      modulator.step(Tone.of(level))
      demodulator.sample(modulator.light)
      (modulator.light, demodulator.level)
    }
  }
  private def wave(name: String, levels: Seq[Boolean]) =
    Wave(name, 1, levels.map(l => BigInt(if (l) 1 else 0)))
  private def fieldsOf(bits: Seq[Int]) =
    Wave(
      "field",
      4,
      bits.map(BigInt(_)),
      bits.map(_ > 0),
      fields
        .map(_._1)
        .zipWithIndex
        .map { case (name, i) =>
          BigInt(i + 1) -> name
        }
        .toMap
    )

  "FR-41: a frame on a link" should "be heard as it was sent" in {
    assert(sent.size == placed.size && placed.exists(_._2))
    // Where a link takes its samples.
    assert(sent.indices.map(i => passed(i * bit + bit * 65 / 100)._2) == sent)
  }

  "Picture docs/ring-frame.svg" should "show the fields and bits of a frame" in {
    val title = "A frame of relay mode, CAN identifier 0x123 with two bytes, at 2 Mbit/s; 1 is recessive"
    val waves = Seq(
      fieldsOf(placed.map(_._1)),
      wave("stuff bit", placed.map(_._2)),
      wave("level sent", sent),
      wave("level sampled", sent.indices.map(i => passed(i * bit + bit * 65 / 100)._2))
    )
    keep("ring-frame.svg", TimingPicture("ring-frame", title, bit * CycleNs, waves))
  }

  "Picture docs/ring-tones.svg" should "show its first bits as tones" in {
    val cycles                  = (Start + 5) * bit
    def each[A](values: Seq[A]) = values.flatMap(Seq.fill(bit)(_)).take(cycles)
    val waves = Seq(
      fieldsOf(each(placed.map(_._1))),
      wave("level sent", each(sent)),
      wave("light", passed.map(_._1).take(cycles)),
      wave("level heard", passed.map(_._2).take(cycles))
    )
    val title = "Its beginning: a tone of 25 MHz is dominant, one of 1 MHz recessive"
    keep("ring-tones.svg", TimingPicture("ring-tones", title, CycleNs, waves))
  }

  // ---- a break ----

  private val heard =
    Map(RingFaults.Dark -> "nothing", RingFaults.Search -> "search", RingFaults.Symbols -> "symbols")
  private val modes = Map(1 -> "mode 1", 2 -> "mode 2", 3 -> "mode 3")
  private def words(name: String, values: Iterable[Int], of: Map[Int, String]) =
    Wave(name, 4, values.map(BigInt(_)).toSeq, words = of.map { case (n, word) => BigInt(n) -> word })

  /** Values of several things, sampled together. */
  private final class Lanes(names: String*) {
    val values: Seq[ArrayBuffer[Int]]             = names.map(_ => ArrayBuffer.empty[Int])
    def sample(now: Int*): Unit                   = for ((v, n) <- values.zip(now)) v += n
    def level(i: Int): Wave                       = wave(names(i), values(i).map(_ != 0).toSeq)
    def words(i: Int, of: Map[Int, String]): Wave = RingPicturesSpec.this.words(names(i), values(i), of)
  }

  /** A ring that is looked at every `stepUs`, and does what is due, while messages are sent on it. */
  private final class Watched(ring: RingPort, stepUs: Int, events: (Int, () => Unit)*)(sample: => Unit)
      extends RingPort {
    private val start  = ring.now
    private val onTime = events.toBuffer
    private val times  = ArrayBuffer.empty[Long]

    /** Of a message: when its sender began, its receiver had it, and its sender knew that. */
    private val messages = ArrayBuffer.empty[(Long, Long, Long)]
    private var isActive = false

    def count: Int                                           = ring.count
    def now: Long                                            = ring.now
    def request(node: Int, slot: Int, frame: BusFrame): Unit = ring.request(node, slot, frame)
    def pending(node: Int): Int                              = ring.pending(node)
    def received(node: Int): Seq[BusFrame]                   = ring.received(node)
    def abort(node: Int): Unit                               = ring.abort(node)
    def runUs(us: Int): Unit = for (_ <- 0 until us by stepUs) {
      while (onTime.headOption.exists(start + _._1 <= now)) onTime.remove(0)._2()
      ring.runUs(stepUs)
      if (isActive) {
        times += now
        sample
      }
    }

    /** Sends messages of so many bytes, one behind the other, until so many us are over. */
    def talk(seed: Long, kbps: Int, from: Int, to: Int, length: Int, us: Int): Unit = {
      val hosts = new Messages(this, seed, _ => false, kbps, pollUs = 5 * stepUs)
      isActive = true
      while (now < start + us) {
        val begin           = now
        val (arrived, over) = hosts.single(from, to, length)()
        messages += ((begin, begin + arrived, begin + over))
      }
    }

    /** The message that is under way, 0: none; how many have come. */
    def sent: Seq[Int] = times.toSeq.map(t => messages.indexWhere(m => m._1 < t && t <= m._3) + 1)
    def came: Seq[Int] = times.toSeq.map(t => messages.count(_._2 <= t))
  }
  private def numbers(what: String, none: String, values: Seq[Int]) =
    values.distinct.map(n => n -> (if (n == 0) none else s"$what$n")).toMap

  "Picture docs/ring-break-bus.svg" should "show a break and its mend in bus mode" in {
    val ring = new BusModeRing(4)
    val r    = ring.ring
    ring.runUs(3000)
    val lanes = new Lanes(
      "2, port 2 hears",
      "3, port 1 hears",
      "node 2",
      "node 3",
      "guard",
      "bus of node 2",
      "bus of node 3",
      "node 2's frames",
      "node 3's frames"
    )
    def hears(n: Int, port: Int) =
      if (!r.bench.signal(n, port)) RingFaults.Dark
      else if (r.bench.hearsSearch(n, port)) RingFaults.Search
      else RingFaults.Symbols
    def frames(n: Int) = {
      val status = r.hosts(n).status
      if ((status >> 4 & 1) == 1) 1 else if ((status >> 5 & 1) == 1) 2 else 0
    }
    def level(n: Int)       = if (r.bench.bus(n)) 1 else 0
    def cut(isCut: Boolean) = () => r.cut(1, isCut)
    val watched = new Watched(ring, 2, 1650 -> cut(true), 2700 -> cut(false))(
      lanes.sample(
        hears(1, 1),
        hears(2, 0),
        r.bench.mode(1),
        r.bench.mode(2),
        r.guards.headOption.fold(0)(_ + 1),
        level(1),
        level(2),
        frames(1),
        frames(2)
      )
    )
    watched.talk(seed = 1, kbps = 400, from = 1, to = 3, length = 5, us = 3000)
    // What the picture is to show: the messages have all come, and the ring was two pieces meanwhile.
    assert(watched.came.last > 1 && watched.came.distinct == (0 to watched.came.last))
    assert(lanes.values(2).distinct.toSeq == Seq(1, 2) && lanes.values(3).contains(3))
    val does = Map(0 -> "", 1 -> "sends", 2 -> "receives")
    val waves = Seq(
      lanes.words(0, heard),
      lanes.words(1, heard),
      lanes.words(2, modes),
      lanes.words(3, modes),
      lanes.words(4, Map(0 -> "none", 1 -> "node 1", 2 -> "node 2")),
      lanes.level(5),
      lanes.level(6),
      lanes.words(7, does),
      lanes.words(8, does),
      words("node 2 sends", watched.sent, numbers("message ", "", watched.sent)),
      words("node 4 has", watched.came, numbers("", "none", watched.came))
    )
    val title =
      "Bus mode, 400 kbit/s: messages from node 2 to 4; the fibre from node 2 to 3 is cut and mended"
    keep("ring-break-bus.svg", TimingPicture("ring-break-bus", title, 2000, waves, 0.7))
  }

  "Picture docs/ring-break-relay.svg" should "show a break and its mend in relay mode" in {
    val link = new RelayModeRing(RingLoad.setting(1, count = 6, km = 1.2), confirmUs = 2000)
    val ring = link.ring
    val lanes = new Lanes(
      "3, port 2 hears",
      "4, port 1 hears",
      "node 3",
      "node 4",
      "pending at node 1",
      "passes node 3",
      "passes node 4",
      "repeats of node 1"
    )
    def cut(isCut: Boolean) = () => {
      link.faults.cut(2, 1, isCut)
      link.faults.cut(3, 0, isCut)
    }
    def isUp(n: Int, port: Int)    = link.faults.isUp(n, port)
    def mode(n: Int)               = if (isUp(n, 0) == isUp(n, 1)) 1 else if (isUp(n, 0)) 2 else 3
    def count(n: Int, which: Int*) = which.map(ring.node(n).counters(_)).sum
    var before                     = Seq.fill(3)(0L)
    val watched = new Watched(link, 4, 700 -> cut(true), 3500 -> cut(false))({
      val passed = Seq(2, 3).map(count(_, RelayCounter.Passed, RelayCounter.Passed + 1).toLong)
      val counts = passed :+ count(0, RelayCounter.Repeated).toLong
      val news   = counts.zip(before).map { case (now, last) => if (now > last) 1 else 0 }
      before = counts
      val pending = Integer.bitCount(link.pending(0))
      lanes.sample(
        Seq(link.faults.hears(2, 1), link.faults.hears(3, 0), mode(2), mode(3), pending) ++ news: _*
      )
    })
    watched.talk(seed = 1, kbps = 2000, from = 0, to = 5, length = 40, us = 5000)
    assert(watched.came.last > 3 && watched.came.distinct == (0 to watched.came.last))
    assert(lanes.values(2).distinct.toSeq == Seq(1, 2) && lanes.values(3).distinct.toSeq == Seq(1, 3))
    val waves = (0 to 1).map(lanes.words(_, heard)) ++ (2 to 3).map(lanes.words(_, modes)) ++
      Seq(lanes.words(4, (0 to 15).map(n => n -> s"$n").toMap)) ++ (5 to 7).map(lanes.level) ++
      Seq(
        words("node 1 sends", watched.sent, numbers("message ", "", watched.sent)),
        words("node 6 has", watched.came, numbers("", "none", watched.came))
      )
    val title =
      "Relay mode, 2 Mbit/s: messages from node 1 to 6; the fibre from node 3 to 4 is cut and mended"
    keep("ring-break-relay.svg", TimingPicture("ring-break-relay", title, 4000, waves, 0.7))
  }

  // ---- latency against load ----

  private case class Loaded(isBroken: Boolean, percent: Int, average: Double, most: Double, longest: Double) {
    def row: String = f"${if (isBroken) 1 else 0},$percent,$average%.3f,$most%.3f,$longest%.3f"
  }
  private val loads    = Paths.get("docs", "ring-load.csv")
  private val LoadedUs = 100000

  private def measure(isBroken: Boolean, percent: Int): Loaded = {
    val ways =
      new RelayFigures(25, seed = percent).atLoad(LinkTiming.FullLoad * percent / 100, isBroken, LoadedUs)
    Loaded(isBroken, percent, ways.sum / ways.size, ways(ways.size * 99 / 100), ways.last)
  }

  "Picture docs/ring-load.svg" should "show how long frames take at a load" in {
    if (writes) {
      val rows =
        for (isBroken <- Seq(false, true); percent <- 10 to 100 by 10) yield measure(isBroken, percent)
      val head = "broken,load_percent,average_ms,99_percent_ms,longest_ms"
      Files.write(loads, (head +: rows.map(_.row)).asJava)
    }
    val rows = Files.readAllLines(loads).asScala.toSeq.drop(1).map(_.split(',')).map {
      case Array(b, p, a, m, l) => Loaded(b == "1", p.toInt, a.toDouble, m.toDouble, l.toDouble)
    }
    // One of them again.
    assert(rows.map(_.row).contains(measure(isBroken = false, 10).row))
    def series(isBroken: Boolean) = {
      val mine = rows.filter(_.isBroken == isBroken)
      Seq[(String, Loaded => Double)]("average" -> (_.average), "99 %" -> (_.most), "longest" -> (_.longest))
        .map { case (title, of) => title -> mine.map(r => r.percent.toDouble -> of(r)) }
    }
    val panels =
      Seq(
        "load of the whole ring, %" -> series(isBroken = false),
        "load of a broken one, %"   -> series(isBroken = true)
      )
    keep("ring-load.svg", Plots.panels("ring-load", "ms to the last node", panels, isLogarithmic = false))
  }

  // ---- section 14 ----

  private val figuresOf = Paths.get("docs", "ring-figures.csv")
  private val Promised = Seq( // idle, urgent at full load, the same broken, message, frames a second
    (25, "2 Mbit/s", 0.9, 4.0, 7.8, 33.0, LinkTiming.FullLoad),
    (125, "400 kbit/s", 4.4, 20.0, 39.0, 163.0, LinkTiming.FullLoad / 5)
  )

  private def idle(linkBit: Int, rate: String, limit: Double) = RingFigure(
    s"Relay mode, $rate, idle ring: way to the farthest node",
    "ms",
    new RelayFigures(linkBit, seed = 1).idle(20),
    Some(limit),
    isLeast = false
  )

  private def full(linkBit: Int, rate: String, isBroken: Boolean, limit: Double, frames: Double) = {
    val (perSecond, urgent, _) = new RelayFigures(linkBit, seed = 1).full(10, isBroken)
    val ring                   = s"Relay mode, $rate, ${if (isBroken) "broken ring" else "ring"} at full load"
    val share                  = if (isBroken) 0.75 else 0.85
    Seq(
      RingFigure(s"$ring: urgent frame", "ms", urgent, Some(limit), isLeast = false),
      RingFigure(s"$ring: throughput", "frames/s", perSecond, Some(share * frames), isLeast = true)
    )
  }

  private def message(linkBit: Int, rate: String, limit: Double): RingFigure = {
    val kbps      = 50000 / linkBit
    val ring      = new RelayModeRing(RingLoad.setting(seed = 4, linkBit = linkBit), 20000000 / kbps)
    val (came, _) = new Messages(ring, 4, _ => false, kbps, pollUs = 50).single(0, 25, 2048)()
    RingFigure(
      s"Relay mode, $rate, idle ring: message of 2 KiB",
      "ms",
      came / 1e3,
      Some(limit),
      isLeast = false
    )
  }

  private def bridge: Seq[RingFigure] = {
    val (average, longest, withBreaks) = BridgeOnEngineSpec.delays(seed = 1, frames = 2000)
    Seq(
      "on average"               -> average,
      "at most"                  -> longest,
      "at most, through a break" -> withBreaks
    ).map { case (what, us) =>
      RingFigure(s"delay by bridge and ring, 10 nodes on 10 km, $what", "us", us, None, isLeast = false)
    }
  }

  /** How fast rings are simulated. */
  private def speeds: Seq[RingFigure] = {
    val folder = Directory.lasting("ring")
    val server = ujson.Obj("preset" -> "ring-server")
    val network = ujson.Obj(
      "mode"  -> "relay",
      "up_ms" -> 1,
      "nodes" -> (server +: Seq.fill(50)(ujson.Obj())),
      "each"  -> ujson.Obj("fibre_km" -> 10.0 / 51)
    )
    val file  = Files.writeString(folder.resolve("ring.json"), ujson.write(network))
    val files = Seq("--network", s"$file", "--state", s"${folder.resolve("state")}")
    val text  = RingProcess.outputOf(files ++ Seq("--end-ms", "5", "--processors", "2"): _*)._1
    val rtl   = "([0-9.]+) ms/s".r.findFirstMatchIn(text).get.group(1).toDouble
    val model = new RelayFigures(25, seed = 1)
    // The first times it is being compiled meanwhile.
    val engine = (1 to 5).map { _ =>
      val start     = System.nanoTime
      val (_, _, l) = model.full(2, isBroken = false)
      l.ring.now / 1e9 / ((System.nanoTime - start) / 1e9)
    }.max
    Seq(
      ("50 nodes and a server in RTL, on two processors", rtl, 0.3),
      ("51 models at full load", engine, 20.0)
    )
      .map { case (what, perSecond, limit) =>
        RingFigure(s"Simulation of $what", "ms/s", perSecond, Some(limit), isLeast = true)
      }
  }

  "Figures of docs/ring-report.md" should "be those of the ring at work" in {
    if (writes) {
      val rows = Promised.flatMap { case (bit, rate, still, urgent, late, long, frames) =>
        Seq(idle(bit, rate, still), message(bit, rate, long)) ++
          full(bit, rate, isBroken = false, urgent, frames) ++
          full(bit, rate, isBroken = true, late, frames)
      } ++ bridge ++ speeds
      Files.write(figuresOf, (RingFigure.Head +: rows.map(_.row)).asJava)
    }
    val rows = RingFigure.read(Paths.get("docs"))
    assert(rows.size == 6 * Promised.size + 5 && rows.flatMap(_.goal).forall(_.reached))
    // One of them again.
    val (bit, rate, still, _, _, _, _) = Promised.head
    assert(rows.map(_.row).contains(idle(bit, rate, still).row))
  }

  // ---- how far bus mode reaches ----

  private case class Reached(kbps: Int, nodes: Int, metres: Int)
  private val table = Paths.get("docs", "ring-reach.csv")

  private def arbitrates(kbps: Int, nodes: Int, metres: Double, frames: Int): Boolean =
    new CanRing(nodes, Some(nodes - 1), CanRing.spread(nodes, metres), 4000 / kbps, coreClockMhz = 100)
      .arbitrate(frames)

  /** The greatest length at which frames get through, within 4 %. */
  private def measure(kbps: Int, nodes: Int): Reached = {
    var (good, bad) = (Reach.metres(kbps, nodes).toDouble, 0.0)
    bad = good + Reach.nodeNs(100) * (nodes - 1) / Reach.NsPerMetre.toDouble
    while (arbitrates(kbps, nodes, bad, 4)) bad *= 1.5
    while (bad - good > 0.04 * good) {
      val middle = (good + bad) / 2
      if (arbitrates(kbps, nodes, middle, 4)) good = middle else bad = middle
    }
    Reached(kbps, nodes, good.toInt)
  }

  "Picture docs/ring-reach.svg" should "show how far bus mode reaches, by rule and by measurement" in {
    if (writes) {
      val rows = for {
        (nodes, least) <- Seq(2 -> 50, 5 -> 50, 10 -> 100, 20 -> 50, 50 -> 20)
        kbps           <- Reach.Rates if kbps >= least && Reach.metres(kbps, nodes) > 0
      } yield measure(kbps, nodes)
      Files.write(table, ("kbps,nodes,metres" +: rows.map(r => s"${r.kbps},${r.nodes},${r.metres}")).asJava)
    }
    val rows = Files.readAllLines(table).asScala.toSeq.drop(1).map(_.split(',').map(_.toInt)).map {
      case Array(kbps, nodes, metres) => Reached(kbps, nodes, metres)
    }
    for (r <- rows) assert(r.metres >= Reach.metres(r.kbps, r.nodes), r)
    // One of them again.
    val r = rows.find(r => r.kbps == 400 && r.nodes == 5).get
    assert(arbitrates(r.kbps, r.nodes, r.metres.toDouble, 4))
    assert(!arbitrates(r.kbps, r.nodes, 1.1 * r.metres, 4))
    val rates = Seq(5.0, 7, 10, 14, 20, 30, 50, 70, 100, 125, 170, 250, 330, 400, 500, 700, 1000)
    val curves = Reach.Nodes.map { n =>
      s"$n nodes" -> rates.map(k => k -> Reach.metres(k.toInt, n) / 1000.0).filter(_._2 >= 0.01)
    }
    val points = Reach.Nodes.map(n =>
      s"$n nodes, measured" -> rows.filter(_.nodes == n).map(r => r.kbps.toDouble -> r.metres / 1000.0)
    )
    keep(
      "ring-reach.svg",
      Plots.curves("ring-reach", "bit rate, kbit/s", "length, km", curves, points.filter(_._2.nonEmpty))
    )
  }
}
