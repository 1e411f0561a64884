package flyframe.server

import java.nio.file.{Files, Path}
import java.time.Instant
import scala.util.{Random, Using}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Directory
import flyframe.protocol.EventKind

class EventStoreSpec extends AnyFlatSpec {
  private val life           = Life(1, 7)
  private val now            = Instant.parse("2026-01-02T03:04:05.678Z")
  private def event(i: Long) = Event(EventKind.Present, 2, 3, i.toInt, 4, 5, 0xffffffffL - i, 0x80000000L + i)

  private def withStore[A](path: Path)(check: EventStore => A): A =
    Using.resource(EventStore.open(path).fold(fail(_), identity))(check)
  private def fresh[A](check: EventStore => A): A = Directory(d => withStore(d.resolve("log.db"))(check))

  private def give(store: EventStore, life: Life, first: Long, count: Int): Seq[Long] =
    store
      .append(Report(life, first, (first until first + count).map(event).toVector, time = first), now)
      .map(_.number)

  private def next(store: EventStore, life: Life): Option[Long] = store.record(life).map(_.next)

  "SRV-05: an event" should "be stored once, with all its fields and the time at which it came" in fresh {
    store =>
      store.begin(life, 0)
      assert(give(store, life, 0, 3) == Seq(0, 1, 2))
      assert(give(store, life, 0, 3) == Nil)
      assert(give(store, life, 1, 4) == Seq(3, 4))
      assert(next(store, life).contains(5L))
      assert(store.latest(10).map(e => (e.number, e.event)) == (0L to 4L).map(i => (i, event(i))))
      assert(store.latest(10).forall(e => e.received == now && e.life == life))
  }

  it should "be another one in another life or of another master" in fresh { store =>
    val lives = Seq(life, Life(1, 8), Life(2, 7))
    lives.foreach(store.begin(_, 0))
    for (l <- lives) assert(give(store, l, 0, 2) == Seq(0, 1))
    assert(store.latest(10).map(_.life) == lives.flatMap(l => Seq(l, l)))
  }

  it should "be stored once whatever is lost, repeated or comes late (seeds 1 to 20)" in {
    for (seed <- 1 to 20) fresh { store =>
      val random = new Random(seed)
      store.begin(life, 0)
      for (_ <- 1 to 200) {
        val wanted = next(store, life).get
        give(store, life, math.max(0, wanted + random.nextInt(12) - 8), random.nextInt(8))
      }
      val stored = store.after(0, 10000)
      assert(stored.size > 50, s"seed $seed")
      assert(stored.map(_.number) == stored.indices.map(_.toLong), s"seed $seed")
      assert(stored.map(_.id) == stored.map(_.id).sorted, s"seed $seed")
    }
  }

  "SRV-19: an alarm record that came in an earlier life" should "be marked, and not be in the log" in fresh {
    store =>
      val (before, after) = (life, Life(1, 8))
      val record = Event(EventKind.Detector, 3, 4, sequence = 9, state = 2, epoch = 6, slaveTime = 77)
      def give(life: Life, events: Event*) =
        store.append(Report(life, store.record(life).get.next, events.toVector), now).map(_.again)
      Seq(before, after, Life(2, 8)).foreach(store.begin(_, 0))
      assert(give(before, record) == Seq(false))
      assert(
        give(after, record.copy(position = 2, masterTime = 5), record.copy(sequence = 10)) == Seq(true, false)
      )
      val others =
        Seq(
          record.copy(node = 5),
          record.copy(epoch = 7),
          record.copy(state = 1),
          record.copy(slaveTime = 78)
        )
      assert(give(after, others: _*).forall(!_), "other records")
      assert(give(Life(2, 8), record) == Seq(false), "of another master")
      val present = Event(EventKind.Present, 3, 4)
      assert(give(before, present) ++ give(after, present) == Seq(false, false), "of another kind")
      assert(store.ofLife(after, 0, 100).map(_.again) == true +: Seq.fill(6)(false))
      assert(store.after(0, 100) == store.latest(100) && store.latest(100).size == 1 + 1 + 4 + 1 + 2)
  }

  "SRV-09: what detectors have told last" should "be known by node ID, of all lives of the master" in fresh {
    store =>
      def told(node: Int, state: Int, epoch: Int) = Event(EventKind.Detector, 0, node, state, state, epoch)
      Seq(Life(1, 7), Life(1, 8), Life(2, 1)).foreach(store.begin(_, 0))
      store.append(Report(Life(1, 7), 0, Vector(told(1, 1, 5), told(2, 2, 5), told(3, 1, 5))), now)
      store.append(Report(Life(1, 8), 0, Vector(told(1, 3, 6), Event(EventKind.Present, 0, 2))), now)
      store.append(Report(Life(2, 1), 0, Vector(told(3, 4, 5))), now)
      assert(store.detectors(1) == Map(1 -> Detected(3, 6), 2 -> Detected(2, 5), 3 -> Detected(1, 5)))
      assert(store.detectors(3).isEmpty)
  }

  "SRV-06: events behind a missing one" should "not be stored" in fresh { store =>
    store.begin(life, 0)
    give(store, life, 0, 3)
    assert(give(store, life, 4, 5) == Nil)
    assert(next(store, life).contains(3L))
    assert(give(store, life, 3, 2) == Seq(3, 4))
  }

  "SRV-07: a life" should "begin where its first report begins" in fresh { store =>
    assert(next(store, life).isEmpty)
    store.begin(life, 100)
    assert(next(store, life).contains(100L))
    store.begin(life, 200)
    assert(next(store, life).contains(100L))
    assert(give(store, life, 98, 5) == Seq(100, 101, 102))
  }

  "SRV-08: what is stored" should "be there after a restart, counters too" in Directory { d =>
    val path = d.resolve("log.db")
    withStore(path) { store =>
      store.begin(life, 0)
      store.begin(Life(2, 1), 0)
      store.begin(Life(1, 8), 0)
      give(store, life, 0, 1500)
      assert(store.nextCounter(life) == 1 && store.nextCounter(life) == 2)
      assert(store.nextCounter(Life(1, 8)) == 1)
      store.remember(life, 70000, now.plusMillis(5))
    }
    withStore(path) { store =>
      assert(next(store, life).contains(1500L))
      assert(store.nextCounter(life) == 3)
      assert(store.youngest.map(_.life) == Seq(Life(1, 8), Life(2, 1)))
      assert(store.record(life).contains(LifeRecord(life, 1500, 70000, now.plusMillis(5))))
      assert(store.ofLife(life, 1000, 100).map(_.number) == (1000 until 1100))
      assert(give(store, life, 1499, 2) == Seq(1500))
    }
  }

  it should "be readable by others while the server runs" in Directory { d =>
    val path = d.resolve("log.db")
    withStore(path) { store =>
      store.begin(life, 0)
      give(store, life, 0, 2)
      withStore(path)(other => assert(other.latest(10).size == 2))
    }
  }

  "SRV-18: a database that cannot be used" should "be refused in one sentence" in Directory { d =>
    def refusal(path: Path) =
      EventStore.open(path).fold(identity, s => { s.close(); fail(s"$path was opened") })
    val text = d.resolve("text")
    Files.writeString(text, "This is no database. " * 100)
    val foreign = d.resolve("foreign.db")
    Using.resource(java.sql.DriverManager.getConnection(s"jdbc:sqlite:$foreign"))(
      _.createStatement.execute("create table event (x)")
    )
    for (path <- Seq(d, d.resolve("no/such/directory/log.db"), text, foreign)) {
      val sentence = refusal(path)
      assert(sentence.endsWith(".") && !sentence.contains('\n') && sentence.contains(path.toString), sentence)
    }
    assert(Files.size(text) == 2100)
  }
}
