package flyframe.alarm

import scala.util.Random
import chisel3._
import chisel3.util._
import chiseltest._
import flyframe.SharedSimulation
import flyframe.protocol.DetectorState.{Alarm, Normal, Off, Open, Short}
import org.scalatest.flatspec.AnyFlatSpec

/** The queue with a time that counts cycles, and a player that lets events pass by the thousand: the state
  * changes every 64 of them.
  */
class QueueBench(depth: Int) extends Module {
  private val queue      = Module(new AlarmQueue(depth))
  val plays              = IO(Input(Bool()))
  val state              = IO(Input(chiselTypeOf(queue.state)))
  val test               = IO(Input(Bool()))
  val epoch              = IO(Input(UInt(8.W)))
  val forget             = IO(Input(Bool()))
  val acknowledge        = IO(Flipped(Valid(new RecordAck)))
  val acknowledgeChanges = IO(Input(Bool()))
  val confirm            = IO(Flipped(Valid(UInt(16.W))))
  val confirmChanges     = IO(Input(Bool()))
  val newMaster          = IO(Input(Bool()))
  val elapsed            = IO(Output(UInt(64.W)))
  val offers             = IO(Output(Bool()))
  val isUrgent           = IO(Output(Bool()))
  val busy               = IO(Input(Bool()))
  val read               = IO(Input(Bool()))
  val readWord           = IO(Input(UInt(3.W)))
  val readData           = IO(Output(UInt(16.W)))
  val waiting            = IO(Output(Bool()))
  val dropped            = IO(Output(UInt(8.W)))
  val lacking            = IO(Output(Bool()))

  private val cycles = RegInit(0.U(64.W))
  when(!queue.hold) { cycles := cycles + 1.U }
  queue.state              := Mux(plays, Mux(cycles(6), Open.U, Normal.U), state)
  queue.time               := cycles
  queue.wraps              := !queue.hold && cycles(15, 0).andR
  elapsed                  := cycles
  queue.test               := test
  queue.epoch              := epoch
  queue.forget             := forget
  queue.acknowledge        := acknowledge
  queue.acknowledgeChanges := acknowledgeChanges
  queue.confirm            := confirm
  queue.confirmChanges     := confirmChanges
  queue.newMaster          := newMaster
  queue.busy               := busy || RegNext(queue.offers && busy, false.B)
  queue.read               := read
  queue.readWord           := readWord
  readData                 := queue.readData
  offers                   := queue.offers
  isUrgent                 := queue.isUrgent
  waiting                  := queue.waiting
  dropped                  := queue.dropped
  lacking                  := queue.lacking
}

class AlarmQueueSpec extends AnyFlatSpec with SharedSimulation {
  private def is(b: Bool)     = b.peekBoolean()
  private def number(n: UInt) = n.peekInt().toInt

  /** What is on offer, as the appender reads it. */
  private case class Offer(sequence: Int, state: Int, epoch: Int, time: Long) {
    def guard: Int = (time & 0xffff).toInt
  }

  private class Driver(dut: QueueBench) {
    dut.plays.poke(false)
    dut.state.poke(Off)
    dut.test.poke(false)
    dut.epoch.poke(0x5a)
    dut.forget.poke(false)
    dut.acknowledge.valid.poke(false)
    dut.acknowledgeChanges.poke(false)
    dut.confirm.valid.poke(false)
    dut.confirmChanges.poke(false)
    dut.newMaster.poke(false)
    dut.busy.poke(false)
    dut.read.poke(false)

    // As registers behind a write: bytes change in one cycle, in the next they are there.
    def acknowledge(sequence: Int, guard: Int, tag: Int): Unit = {
      dut.acknowledgeChanges.poke(true)
      dut.clock.step()
      dut.acknowledgeChanges.poke(false)
      dut.acknowledge.bits.sequence.poke(sequence)
      dut.acknowledge.bits.guard.poke(guard)
      dut.acknowledge.bits.tag.poke(tag)
      dut.acknowledge.valid.poke(true)
      dut.clock.step()
      dut.acknowledge.valid.poke(false)
    }
    private var life = 0
    def confirm(number: Int, life: Int): Unit = {
      dut.confirmChanges.poke(true)
      dut.newMaster.poke(life != this.life)
      dut.clock.step()
      this.life = life
      dut.newMaster.poke(false)
      dut.confirmChanges.poke(false)
      dut.confirm.bits.poke(number & 0xffff)
      dut.confirm.valid.poke(true)
      dut.clock.step()
      dut.confirm.valid.poke(false)
    }
    def state(now: Int, test: Boolean = false): Unit = {
      dut.state.poke(now)
      dut.test.poke(test)
      dut.forget.poke(now == Off)
    }
    def forget(): Unit = {
      dut.forget.poke(true)
      dut.clock.step()
      dut.forget.poke(false)
    }
    def settle(): Unit = dut.clock.step(400)

    /** Reading takes the RAM from the queue's own work. */
    def offer(): Option[Offer] = Option.when(is(dut.offers)) {
      dut.busy.poke(true)
      dut.read.poke(true)
      val words = (0 until 6).map { i =>
        dut.readWord.poke(i)
        dut.clock.step()
        number(dut.readData)
      }
      dut.read.poke(false)
      Offer(
        words(0),
        words(1) & 0xff,
        words(1) >> 8,
        words.drop(2).zipWithIndex.map { case (w, i) => w.toLong << (16 * i) }.sum
      )
    }
    def release(): Unit = dut.busy.poke(false)
  }

  /** ALARM-03 to ALARM-05 in plain words. */
  private class Scene(dut: QueueBench, depth: Int, seed: Int, var next: Int) {
    val random = new Random(seed)
    val driver = new Driver(dut)
    private class Record(val sequence: Int, val state: Int) {
      var told    = Option.empty[Int]
      def isAlarm = state == Alarm
    }
    private var kept     = Vector.empty[Record]
    private var reported = -1
    private var dropped  = number(dut.dropped)
    private var lacks    = is(dut.lacking)
    private var life     = 0
    private var tag      = 0xfff0

    private def best = {
      val untold = kept.filter(_.told.isEmpty)
      untold.find(_.isAlarm).orElse(untold.headOption)
    }
    def change(now: Int, test: Boolean): Unit = {
      driver.state(now, test)
      val code = now | (if (test) 0x80 else 0)
      if (now == Off) reported = -1
      else if (code != reported) {
        reported = code
        val record  = new Record(next, code)
        val plain   = kept.filterNot(_.isAlarm)
        val victims = plain.filter(_.told.isDefined) ++ plain
        next = next % 0xffff + 1
        if (kept.size < depth) kept :+= record
        else {
          if (!victims.headOption.exists(_.told.isDefined)) {
            dropped += 1
            lacks = true
          }
          val alarm = Option.when(record.isAlarm)(kept.find(_.told.isDefined).getOrElse(kept.last))
          for (victim <- victims.headOption.orElse(alarm)) kept = kept.filter(_ ne victim) :+ record
        }
      }
    }
    def check(what: String): Option[Offer] = {
      driver.settle()
      assert(is(dut.waiting) == best.isDefined, what)
      assert(number(dut.dropped) == (dropped min 255), what)
      if (kept.isEmpty) lacks = false
      assert(is(dut.lacking) == lacks, what)
      assert(is(dut.offers) == best.isDefined, what)
      val offer = driver.offer()
      driver.release()
      for (o <- offer; r <- best) {
        assert((o.sequence, o.state, o.epoch) == ((r.sequence, r.state, 0x5a)), what)
        assert(is(dut.isUrgent) == r.isAlarm, what)
      }
      offer
    }
    def acknowledge(o: Offer): Unit = {
      driver.acknowledge(o.sequence, o.guard, tag)
      kept.filter(_.sequence == o.sequence).foreach(_.told = Some(tag))
      tag = (tag + 1) & 0xffff
    }
    def confirm(number: Int, life: Int): Unit = {
      driver.confirm(number, life)
      if (life != this.life) {
        this.life = life
        kept.foreach(_.told = None)
      } else
        kept = kept.filterNot(_.told.exists { t =>
          ((t - number) & 0xffff) > 0xff
        })
    }
    def step(n: Int): Unit = {
      val what  = s"step $n"
      val offer = check(what)
      random.nextInt(16) match {
        case 0 | 1 | 2 | 3 | 4 => change(1 + random.nextInt(4), random.nextInt(8) == 0)
        case 5                 => change(Off, test = false)
        case 6 | 7 | 8 | 9     => offer.foreach(acknowledge)
        case 10 => for (o <- offer) driver.acknowledge(o.sequence + 1, o.guard, tag) // of nothing there is
        case 11 => for (o <- offer) driver.acknowledge(o.sequence, o.guard ^ 1 << random.nextInt(16), tag)
        case 12 => confirm(tag - random.nextInt(4), life)
        case 13 => confirm(tag - 0x10a + random.nextInt(20), life)
        case 14 => if (random.nextInt(4) == 0) confirm(tag, life + 1)
        case _ => // in use while everything changes
          for (before <- offer) {
            dut.busy.poke(true)
            for (_ <- 1 to 1 + random.nextInt(3)) {
              change(1 + random.nextInt(4), test = false)
              driver.settle()
              if (random.nextInt(3) == 0) confirm(tag - random.nextInt(4), life)
            }
            driver.settle()
            assert(driver.offer().forall(_ == before), what)
            driver.release()
          }
      }
    }
  }

  together("16 records", new QueueBench(16))(
    "ALARM-03, ALARM-04, ALARM-05: changes, orders right and wrong, and a reader, at random" -> { dut =>
      val scene = new Scene(dut, depth = 16, seed = 1, next = 1)
      (1 to 3000).foreach(scene.step)
    },
    "ALARM-05: 16 alarms and one more" -> { dut =>
      val scene = new Scene(dut, depth = 16, seed = 2, next = 1)
      for (i <- 1 to 40) {
        scene.change(Alarm, test = false)
        scene.check(s"alarm $i")
        scene.change(if (i % 3 == 0) Open else Off, test = false)
        scene.check(s"behind alarm $i")
      }
      // Not the first one only: all that should be there are, the last one among them.
      for (n <- 1 to 17) scene.check(s"record $n of those kept").foreach(scene.acknowledge)
    },
    "ALARM-03, ALARM-05: nothing disappears uncounted, whenever orders come" -> { dut =>
      val random = new Random(3)
      val driver = new Driver(dut)
      var seen   = Set.empty[Int]
      var tag    = 0
      def look(): Unit = for (o <- driver.offer()) {
        seen += o.sequence
        if (random.nextInt(4) > 0) driver.acknowledge(o.sequence, o.guard, tag)
        tag += 1
        driver.release()
      }
      for (_ <- 1 to 4000) {
        random.nextInt(8) match {
          case 0 | 1 => driver.state(1 + random.nextInt(4))
          case 2     => driver.confirm(tag, 7)
          case 3     => driver.confirm(tag - random.nextInt(20), 7)
          case _     => look()
        }
        dut.clock.step(1 + random.nextInt(200))
      }
      driver.state(Short)
      driver.settle()
      driver.state(Alarm)
      for (_ <- 1 to 40) {
        driver.settle()
        for (o <- driver.offer()) {
          seen += o.sequence
          driver.acknowledge(o.sequence, o.guard, tag)
          tag += 1
          driver.release()
        }
      }
      assert(!is(dut.waiting) && !is(dut.offers))
      val gaps = seen.max - seen.size
      assert(seen.size > 300 && gaps <= number(dut.dropped), s"${seen.size} of ${seen.max} records")
    },
    "ALARM-05: a full queue takes an alarm while its offer is in use, and while orders never end" -> { dut =>
      val driver = new Driver(dut)
      for (i <- 1 to 16) {
        driver.state(if (i % 2 == 0) Normal else Open)
        driver.settle()
      }
      dut.busy.poke(true)
      driver.state(Alarm)
      for (i <- 1 to 200) {
        driver.acknowledge(0x1000, i, i)
        driver.confirm(i, i)
      }
      driver.state(Normal)
      driver.settle()
      driver.release()
      driver.settle()
      val offer = driver.offer().get
      assert((offer.sequence, offer.state) == ((17, Alarm)) && is(dut.isUrgent))
    },
    "ALARM-02: a record has the time of its change, also where the low word of the time is over" -> { dut =>
      val driver  = new Driver(dut)
      def elapsed = dut.elapsed.peekInt().toLong
      for (offset <- -16 to 4) { // to the carry, in cycles
        dut.clock.step((((elapsed >> 16) + 1 << 16) - elapsed + offset).toInt)
        val before = elapsed
        driver.state(if (offset % 2 == 0) Alarm else Open)
        driver.settle()
        for (offer <- driver.offer()) {
          assert(offer.time >= before && offer.time <= before + 30, s"$offset")
          driver.release()
          driver.acknowledge(offer.sequence, offer.guard, 0)
          driver.settle()
          driver.confirm(1, 0)
        }
        assert(!is(dut.waiting), s"$offset")
      }
    },
    "ALARM-02: what is forgotten is recorded anew" -> { dut =>
      val driver = new Driver(dut)
      def states = Iterator
        .continually(driver.offer())
        .takeWhile(_.isDefined)
        .take(10)
        .map { o =>
          driver.release()
          driver.acknowledge(o.get.sequence, o.get.guard, 0)
          driver.settle()
          o.get.state
        }
        .toSeq
      driver.state(Alarm)
      driver.settle()
      driver.forget()
      driver.settle()
      driver.state(Off)
      driver.settle()
      driver.state(Alarm)
      driver.settle()
      driver.state(Alarm, test = true)
      driver.settle()
      assert(states == Seq(Alarm, Alarm, Alarm, Alarm | 0x80))
    }
  )

  together("2 records", new QueueBench(2))(
    "ALARM-02, ALARM-05: numbers wrap, and leave out 0" -> { dut =>
      new Driver(dut)
      dut.plays.poke(true)
      dut.clock.step(66 * 65450)
      dut.plays.poke(false)
      val driver = new Driver(dut)
      driver.settle()
      assert(number(dut.dropped) == 255)
      driver.state(Short)
      driver.settle()
      val low = driver.offer().get.sequence
      driver.release()
      assert(low > 65300 && low < 65536, s"$low")
      var numbers = Vector.empty[Int]
      for (i <- 1 to 300) {
        driver.state(if (i % 2 == 0) Open else Short)
        driver.settle()
        for (o <- driver.offer()) {
          numbers :+= o.sequence
          driver.acknowledge(o.sequence, o.guard, 0)
          driver.release()
        }
      }
      assert(numbers.contains(65535) && !numbers.contains(0))
      for (Seq(a, b) <- numbers.sliding(2)) assert(b == a % 65535 + 1)
    }
  )
}
