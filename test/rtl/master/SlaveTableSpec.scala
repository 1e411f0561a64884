package flyframe.master

import chisel3._
import chiseltest._
import flyframe.SharedSimulation
import flyframe.protocol.{EventKind, SlaveStatus}
import org.scalatest.flatspec.AnyFlatSpec

/** Table, scanner, orders and events together: they have the table in turns, as in a master. */
class TableBench(maxSlaves: Int) extends Module {
  private val table   = Module(new SlaveTable(maxSlaves))
  private val scanner = Module(new SlaveScanner(maxSlaves))
  private val orders  = Module(new OrderSender(maxSlaves))
  private val events  = Module(new EventWriter(maxSlaves))
  private val slot    = Module(new EventSlot)

  /** The table is swept; whose turn it is otherwise: events, orders, or answers. */
  val sweep      = IO(chiselTypeOf(table.sweep))
  val idle       = IO(Input(Bool()))
  val noting     = IO(Input(Bool()))
  val notes      = IO(Input(Bool()))
  val isNoting   = IO(Output(Bool()))
  val known      = IO(Input(UInt(8.W)))
  val listed     = IO(Input(Bool()))
  val start      = IO(Input(Bool()))
  val isOrder    = IO(Input(Bool()))
  val restarts   = IO(Input(Bool()))
  val answered   = IO(Input(UInt(8.W)))
  val words      = IO(Input(Vec(8, UInt(16.W))))
  val begins     = IO(Input(Bool()))
  val asks       = IO(Input(Bool()))
  val mine       = IO(Input(Bool()))
  val gone       = IO(Input(Bool()))
  val offers     = IO(Output(Bool()))
  val taken      = IO(Input(Bool()))
  val position   = IO(Output(UInt(8.W)))
  val busy       = IO(Output(Bool()))
  val newSound   = IO(Output(Bool()))
  val forgets    = IO(Output(Bool()))
  val silence    = IO(Input(Bool()))
  val resetAlarm = IO(Input(Bool()))
  val due        = IO(Output(Bool()))
  val forget     = IO(Input(Bool()))
  val over       = IO(Input(Bool()))
  val expires    = IO(Output(Bool()))
  val givenUp    = IO(Output(Bool()))
  val asksOrder  = IO(Input(Bool()))
  val hasOrder   = IO(Output(Bool()))
  val seeksOrder = IO(Output(Bool()))
  val tookOrder  = IO(Input(Bool()))
  val orderAt    = IO(Output(UInt(8.W)))
  val order      = IO(Output(UInt(2.W)))
  val status     = IO(Input(UInt(19.W)))
  val room       = IO(Input(Bool()))
  val event      = IO(chiselTypeOf(slot.event))
  val summary    = IO(Output(Bool()))
  val window     = IO(Input(UInt(8.W)))
  val windowByte = IO(Input(UInt(3.W)))
  val state      = IO(Output(UInt(8.W)))
  val expect     = IO(chiselTypeOf(table.expect))
  val count      = IO(Output(UInt(8.W)))
  val look       = IO(Input(UInt(10.W)))
  val lookData   = IO(Output(UInt(8.W)))

  table.sweep         := sweep
  table.write         := scanner.write
  table.writeAt       := Mux(idle, events.readAt, scanner.writeAt)
  table.writeData     := scanner.writeData
  scanner.clears      := sweep.valid
  table.changes.valid := scanner.changes || events.tells
  table.changes.bits  := !idle
  table.readAt        := Mux(idle, events.readAt, scanner.readAt)
  when(noting) {
    table.readAt.position := orders.readAt
    table.readAt.word     := 0.U
  }
  table.window     := window
  table.windowByte := windowByte
  state            := table.windowState
  table.expect     := expect
  count            := table.listed
  table.look       := look
  lookData         := table.lookData

  scanner.begin    := begins
  scanner.asks     := asks
  offers           := scanner.offers
  scanner.taken    := taken
  position         := scanner.position
  scanner.mine     := mine
  scanner.gone     := gone
  scanner.known    := known
  scanner.listed   := listed
  scanner.start    := start
  scanner.isOrder  := isOrder
  scanner.restarts := restarts
  scanner.answered := answered
  scanner.answer   := RegNext(words(scanner.place))
  busy             := scanner.busy
  scanner.data     := table.data
  scanner.expected := table.expected
  newSound         := scanner.newSound
  forgets          := scanner.forgets

  orders.silence    := silence
  orders.resetAlarm := resetAlarm
  due               := orders.due
  orders.notes      := notes
  isNoting          := orders.noting
  orders.sounds     := (table.data & SlaveStatus.Sounding.U).orR
  orders.smoke      := (table.data & (SlaveStatus.Alarm | SlaveStatus.Latched).U).orR
  orders.crowded    := false.B
  orders.forget     := forget
  orders.over.valid := over
  orders.over.bits  := true.B
  expires           := orders.expires
  givenUp           := orders.givenUp
  orders.begin      := begins
  orders.asks       := asksOrder
  hasOrder          := orders.offers
  seeksOrder        := orders.busy
  orders.taken      := tookOrder
  orderAt           := orders.position
  orders.mine       := mine
  order             := orders.order
  orders.done       := scanner.ordered
  orders.doneAt     := scanner.subject

  events.run        := idle
  events.known      := known
  events.forget     := false.B
  events.isWrong    := (table.data & SlaveStatus.Wrong.U).orR
  events.untold     := table.untold
  events.status     := status
  events.present    := known
  events.cut        := 0x33.U
  events.framesLost := "h0304".U
  events.room       := room
  events.free       := slot.free
  summary           := events.wrong
  slot.write        := events.fills
  slot.place        := events.place
  slot.kind         := events.kind
  slot.position     := events.owner
  slot.answer       := 0.U
  slot.data         := table.data
  slot.own          := events.own
  slot.offer        := events.offer
  slot.cancel       := false.B
  event <> slot.event
}

/** What becomes of what slaves say. */
class SlaveTableSpec extends AnyFlatSpec with SharedSimulation {
  import SlaveStatus._

  private class Table(dut: TableBench, slaves: Int = 4) {
    for (
      b <- Seq(
        dut.restarts,
        dut.sweep.valid,
        dut.idle,
        dut.noting,
        dut.notes,
        dut.listed,
        dut.start,
        dut.isOrder,
        dut.begins,
        dut.asks
      ) ++
        Seq(
          dut.mine,
          dut.gone,
          dut.taken,
          dut.silence,
          dut.resetAlarm,
          dut.forget,
          dut.over,
          dut.asksOrder
        ) ++
        Seq(dut.tookOrder, dut.expect.valid)
    ) b.poke(false)
    dut.known.poke(slaves)
    dut.room.poke(true)
    dut.status.poke(0)
    dut.event.ready.poke(true)
    private var words           = Vector.empty[Int]
    var sounds                  = 0
    var forgotten               = Vector.empty[Int]
    var givenUp                 = 0
    private def is(b: Bool)     = b.peekBoolean()
    private def number(u: UInt) = u.peekInt().toInt
    def cycle(n: Int = 1): Unit = for (_ <- 1 to n) {
      if (is(dut.event.valid) && is(dut.event.ready)) words :+= number(dut.event.bits)
      if (is(dut.newSound)) sounds += 1
      if (is(dut.forgets)) forgotten :+= number(dut.answered)
      if (is(dut.givenUp)) givenUp += 1
      dut.clock.step()
    }
    def pulse(b: Bool): Unit = {
      b.poke(true)
      cycle()
      b.poke(false)
    }
    dut.sweep.valid.poke(true)
    for (i <- 0 until 32) {
      dut.sweep.bits.poke(i)
      cycle()
    }
    dut.sweep.valid.poke(false)

    def expect(position: Int, node: Int): Unit = {
      dut.window.poke(position)
      dut.expect.bits.poke(node)
      pulse(dut.expect.valid)
      dut.listed.poke(true)
    }

    /** The slave answers; `counter` 0: it does not. */
    def answer(
        position: Int,
        status: Int,
        node: Int = 0,
        self: Int = 0x2101,
        last: Int = 0,
        counter: Int = 1
    ): Unit = {
      val all = Seq(0, 0, status, node, self, last, 0, counter)
      for ((w, i) <- all.zipWithIndex) dut.words(i).poke(w)
      dut.answered.poke(position)
      pulse(dut.start)
      while (is(dut.busy)) cycle()
    }
    def missing(position: Int): Unit = answer(position, 0xffff, 0xffff, 0xffff, 0xffff, counter = 0)

    /** The order for a slave has come back, with this working counter. */
    def ordered(position: Int, counter: Int, reset: Boolean = false): Unit = {
      dut.isOrder.poke(true)
      dut.restarts.poke(reset)
      answer(position, 0xffff, counter = counter)
      dut.isOrder.poke(false)
    }
    def state(position: Int): (Int, Int, Int, Int) = {
      dut.window.poke(position)
      val bytes = (0 to 7).map { i =>
        dut.windowByte.poke(i)
        cycle()
        number(dut.state)
      }
      val Seq(a, b, c, d) = bytes.grouped(2).map(w => w.head | w.last << 8).toSeq
      (a, b, c, d)
    }
    def status(position: Int): Int = state(position)._1

    /** Events of some rounds. */
    def events(): Seq[Seq[Int]] = {
      dut.idle.poke(true)
      cycle(200)
      dut.idle.poke(false)
      val all = words.grouped(8).toSeq
      words = Vector.empty
      all
    }
    def isWrong: Boolean = {
      events()
      is(dut.summary)
    }

    /** It is noted for whom what was asked for is. */
    def note(): Unit = {
      assert(is(dut.due))
      pulse(dut.notes)
      dut.noting.poke(true)
      while (is(dut.isNoting)) cycle()
      dut.noting.poke(false)
    }

    /** Orders of a frame: position and order. */
    def orders(): Seq[(Int, Int)] = {
      pulse(dut.begins)
      dut.mine.poke(true)
      dut.asksOrder.poke(true)
      var all = Vector.empty[(Int, Int)]
      cycle()
      while (is(dut.hasOrder) || is(dut.seeksOrder)) {
        if (is(dut.hasOrder)) {
          all :+= number(dut.orderAt) -> number(dut.order)
          pulse(dut.tookOrder)
        } else cycle()
      }
      dut.asksOrder.poke(false)
      all
    }

    /** Positions that are asked in a frame. */
    def reads(): Seq[Int] = {
      pulse(dut.begins)
      dut.asks.poke(true)
      dut.mine.poke(true)
      var all = Vector.empty[Int]
      while (is(dut.offers)) {
        all :+= number(dut.position)
        pulse(dut.taken)
      }
      dut.asks.poke(false)
      all
    }
  }

  together("of 8", new TableBench(8))(
    "LM-11: what a slave says is there for the host and for reports; it is an event once" -> { dut =>
      val t = new Table(dut)
      t.answer(2, Open, 0x1234, 0x5501, 0x0307)
      assert(t.state(2) == ((Open, 0x1234, 0x5501, 0x0307)))
      for ((byte, i) <- Seq(0, Open, 0x12, 0x34).zipWithIndex) {
        dut.look.poke(2 << 2 | i)
        t.cycle()
        assert(dut.lookData.peekInt() == byte)
      }
      assert(t.events() == Seq(Seq(EventKind.Slave << 8 | 2, 0x1234, Open, 0x0155, 0, 0, 0, 0x0703)))
      t.answer(2, Open, 0x1234, 0x5501, 0x0307)
      assert(t.events().isEmpty)
      // Waiting records and links are no change of state.
      t.answer(2, Open | Waiting, 0x1234, 0x5501, 0x0207)
      assert(t.events().isEmpty && t.status(2) == (Open | Waiting))
      for (
        (status, node, self, last) <-
          Seq(
            (Short, 0x1234, 0x5501, 0x0207),
            (Short, 1, 0x5501, 0x0207),
            (Short, 1, 0x5502, 0x0207),
            (Short, 1, 0x5502, 8)
          )
      ) {
        t.answer(2, status, node, self, last)
        assert(t.events().size == 1)
      }
    },
    "LM-12: without room changes wait, and run together" -> { dut =>
      val t = new Table(dut)
      dut.room.poke(false)
      t.answer(1, Open, 7)
      t.answer(1, Short, 7)
      t.answer(3, Open, 8)
      dut.status.poke(0x60001)
      assert(t.events().isEmpty)
      dut.room.poke(true)
      val events = t.events()
      assert(
        events.map(_.take(3)).toSet == Set(Seq(0x0201, 7, Short), Seq(0x0203, 8, Open), Seq(0x0304, 0x33, 1))
      )
      assert(events.find(_.head >> 8 == EventKind.Line).get.drop(3) == Seq(6, 0, 0, 0, 0x0304))
      assert(t.events().isEmpty)
    },
    "LM-11: who does not answer is absent, and stays what it was; a sounder that comes back is heard" -> {
      dut =>
        val t = new Table(dut)
        t.answer(1, Alarm | Latched | Sounding, 7, 0x1101, 5)
        assert(t.forgotten.isEmpty)
        t.missing(1)
        assert(t.state(1) == ((Absent | Alarm | Latched, 7, 0x1101, 5)) && t.sounds == 1)
        assert(t.forgotten == Seq(1), "its records")
        t.missing(1)
        assert(t.status(1) == (Absent | Alarm | Latched))
        t.answer(1, Alarm | Latched | Sounding, 7, 0x1101, 5)
        assert(t.status(1) == (Alarm | Latched | Sounding) && t.sounds == 2)
        t.answer(1, Alarm | Latched | Sounding, 7, 0x1101, 5)
        assert(t.sounds == 2, "it has not gone on again")
        t.answer(1, Latched, 7)
        t.answer(1, Latched | Sounding, 7)
        assert(t.sounds == 3)
    },
    "LM-11: who never answered is absent only where somebody is expected" -> { dut =>
      val t = new Table(dut)
      t.missing(1)
      assert(t.status(1) == 0 && t.events().isEmpty)
      t.expect(1, 5)
      t.missing(1)
      assert(t.status(1) == (Absent | Wrong))
      t.expect(1, 0)
      t.missing(1)
      assert(t.status(1) == Absent)
    },
    "LM-11: another one than expected, or one that is in no list, is wrong" -> { dut =>
      val t = new Table(dut)
      t.answer(2, 0, 5)
      assert(t.status(2) == 0)
      for (
        (expected, node, wrong) <- Seq((5, 5, 0), (6, 5, Wrong), (0, 5, Wrong), (0, 0, Wrong), (6, 6, 0))
      ) {
        t.expect(2, expected)
        t.answer(2, 0, node)
        assert(t.status(2) == wrong && t.isWrong == (wrong != 0), s"$expected $node")
      }
      dut.listed.poke(false)
      t.expect(2, 9)
      dut.listed.poke(false)
      t.answer(2, 0, 6)
      assert(t.status(2) == 0)
    },
    "LM-11: the list is as long as the last one that is expected" -> { dut =>
      val t     = new Table(dut)
      def count = dut.count.peekInt()
      assert(count == 0)
      for (i <- 0 to 7) t.expect(i, if (i < 6 && i != 2) i + 1 else 0)
      assert(count == 6)
      for (i <- 0 to 7) t.expect(i, if (i < 4) i + 1 else 0)
      assert(count == 4)
      for (i <- Seq(8, 9, 64, 255)) t.expect(i, 5)
      assert(count == 4, "there are eight places")
    },
    "LM-07: silence goes to those that sounded, reset to those with smoke, until it has arrived" -> { dut =>
      val t = new Table(dut)
      for ((s, i) <- Seq(Sounding | Latched, 0, Sounding, Latched).zipWithIndex) t.answer(i, s, i + 1)
      t.pulse(dut.silence)
      t.note()
      assert(t.orders() == Seq(0 -> 1, 2 -> 1))
      t.ordered(0, 1)
      t.ordered(2, 0)
      t.answer(1, Sounding, 2)
      t.orders()
      assert(t.orders() == Seq(2 -> 1), "not the one that sounds since then")
      t.ordered(2, 1)
      t.orders()
      assert(t.orders().isEmpty)
      t.pulse(dut.resetAlarm)
      t.pulse(dut.silence)
      t.note()
      val all = (1 to 4).flatMap(_ => t.orders()).toSet
      assert(all == Set(0 -> 2, 1 -> 1, 3 -> 2))
    },
    "LM-07: an order ends with its slave, with a change of positions, and after 1024 cycles" -> { dut =>
      for (way <- 0 to 2) {
        val t = new Table(dut)
        t.answer(1, Sounding, 2)
        t.pulse(dut.silence)
        t.note()
        assert(t.orders() == Seq(1 -> 1) && t.givenUp == 0)
        way match {
          case 0 => t.missing(1)
          case 1 => t.pulse(dut.forget)
          case 2 =>
            for (_ <- 1 to 1023) t.pulse(dut.over)
            t.orders()
            assert(t.orders() == Seq(1 -> 1))
            dut.over.poke(true)
            assert(dut.expires.peekBoolean())
            t.pulse(dut.over)
        }
        assert(t.givenUp == (if (way == 0) 0 else 1), "who sounds still is to be heard")
        t.answer(1, Sounding, 2)
        for (_ <- 1 to 4) assert(t.orders().isEmpty, s"way $way")
      }
    },
    "LM-07: what an order has ended is over in the table, so that it is new when it comes again" -> { dut =>
      val t   = new Table(dut)
      val all = Alarm | Latched | Sounding | Open
      for (i <- 0 to 2) t.answer(i, all, i + 1)
      t.events()
      t.ordered(0, 1)
      t.ordered(1, 1, reset = true)
      t.ordered(2, 0, reset = true)
      assert((0 to 2).map(t.status) == Seq(Alarm | Latched | Open, Open, all) && t.events().size == 2)
      assert(t.sounds == 3 && t.state(0)._2 == 1)
      for (i <- 0 to 2) t.answer(i, all, i + 1)
      assert(t.sounds == 5)
    },
    "LM-01: four slaves are read in a frame, all in turns, none of them twice" -> { dut =>
      for (known <- 1 to 7) {
        val t = new Table(dut, known)
        assert((1 to 14).flatMap(_ => t.reads()).take(2 * known).distinct.size == known)
        assert((1 to 9).forall { _ =>
          val reads = t.reads()
          reads.size <= 4 && reads.distinct.size == reads.size && reads.nonEmpty
        })
      }
    },
    "LM-12: an event whose writing ends too early comes later" -> { dut =>
      for (after <- 1 to 30) {
        val t = new Table(dut, 2)
        t.answer(1, Open, after)
        dut.idle.poke(true)
        t.cycle(after)
        dut.idle.poke(false)
        t.cycle(30)
        assert(t.events().map(_.take(2)) == Seq(Seq(0x0201, after)), s"after $after cycles")
      }
    }
  )
}
