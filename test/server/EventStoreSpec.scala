package flyframe.server

import java.nio.file.{Files, Path, StandardCopyOption}
import java.sql.{DriverManager, SQLException}
import java.time.Instant
import scala.util.{Random, Using}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.Directory
import flyframe.protocol.{DetectorState, EventKind}

class EventStoreSpec extends AnyFlatSpec {
  private val life = Life(1, 7)
  private val now  = Instant.parse("2026-01-02T03:04:05.678Z")
  private def event(i: Long) =
    Event(EventKind.Slave, 2, 3, i.toInt, 4, 5, 0xffffffffffffL - i, 0x123456780000L + i)

  private def withStore[A](path: Path)(check: EventStore => A): A =
    Using.resource(EventStore.open(path).fold(fail(_), identity))(check)
  private def fresh[A](check: EventStore => A): A = Directory(d => withStore(d.resolve("log.db"))(check))

  private def report(life: Life, first: Long, events: Event*) = Report(life, 0, 1, first, events.toVector)
  private def give(store: EventStore, life: Life, first: Long, count: Int): Seq[Long] =
    store.take(report(life, first, (first until first + count).map(event): _*), now)._1.map(_.number)

  private def next(store: EventStore, life: Life): Option[Long] = store.record(life).map(_.next)

  "SRV-05: an event" should "be stored once, with all its fields and the time at which it came" in fresh {
    store =>
      assert(give(store, life, 0, 3) == Seq(0, 1, 2))
      assert(give(store, life, 0, 3) == Nil)
      assert(give(store, life, 1, 4) == Seq(3, 4))
      assert(next(store, life).contains(5L))
      assert(store.latest(10).map(e => (e.number, e.event)) == (0L to 4L).map(i => (i, event(i))))
      assert(store.latest(10).forall(e => e.received == now && e.life == life))
  }

  it should "be another one in another life or of another master" in fresh { store =>
    val lives = Seq(life, Life(1, -8), Life(2, 7))
    for (l <- lives) assert(give(store, l, 0, 2) == Seq(0, 1))
    assert(store.latest(10).map(_.life) == lives.flatMap(l => Seq(l, l)))
  }

  it should "be stored once whatever is lost, repeated or comes late (seeds 1 to 20)" in {
    for (seed <- 1 to 20) fresh { store =>
      val random = new Random(seed)
      for (_ <- 1 to 200) {
        val wanted = next(store, life).getOrElse(0L)
        give(store, life, math.max(0, wanted - random.nextInt(9)), random.nextInt(8))
      }
      val stored = store.after(0, 10000)
      assert(stored.size > 50, s"seed $seed")
      assert(stored.map(_.number) == stored.indices.map(_.toLong), s"seed $seed")
      assert(stored.map(_.id) == stored.map(_.id).sorted, s"seed $seed")
    }
  }

  "SRV-19: an alarm record that came before" should "be marked, and not be in the log" in fresh { store =>
    val (before, after) = (life, Life(1, 8))
    val record          = Event(EventKind.Detector, 3, 4, sequence = 9, state = 2, epoch = 6, slaveTime = 77)
    def give(life: Life, events: Event*) =
      store.take(report(life, next(store, life).getOrElse(0), events: _*), now)._1.map(_.again)
    assert(give(before, record, record) == Seq(false, true), "in one life")
    val early = record.copy(epoch = 0)
    assert(give(before, early, early) == Seq(false, false), "before the host's start each may be a new one")
    assert(
      give(after, record.copy(masterTime = 5), record.copy(sequence = 10)) == Seq(true, false)
    )
    val others =
      Seq(
        record.copy(node = 5),
        record.copy(position = 2),
        record.copy(epoch = 7),
        record.copy(state = 0x82),
        record.copy(slaveTime = 78)
      )
    assert(give(after, others: _*).forall(!_), "other records")
    assert(give(Life(2, 8), record) == Seq(false), "of another master")
    val later = (1 to 40).map(n => record.copy(node = 6, sequence = n, slaveTime = 100L * n))
    assert(give(Life(3, 9), later: _*) ++ give(Life(3, 9), later.last) == Seq.fill(40)(false) :+ true)
    assert(give(Life(3, 9), later.head) == Seq(false), "its epoch has come again after many starts")
    val slave = Event(EventKind.Slave, 3, 4)
    assert(give(before, slave) ++ give(after, slave) == Seq(false, false), "of another kind")
    assert(store.ofLife(after, 0, 100).map(_.again) == true +: Seq.fill(7)(false))
    assert(store.after(0, 100) == store.latest(100) && store.latest(100).size == 1 + 2 + 1 + 5 + 1 + 41 + 2)
  }

  "SRV-08: what was told last" should "be known of each slave and of the master, in one life" in fresh {
    store =>
      def slave(position: Int, status: Int) = Event(EventKind.Slave, position, position + 1, status)
      def line(status: Int)                 = Event(EventKind.Line, 3, 0, status)
      val events = Seq(slave(0, 1), line(1), slave(1, 2), slave(0, 3), line(2), Event(EventKind.Command, 0))
      store.take(report(life, 0, events: _*), now)
      store.take(report(Life(1, 8), 0, slave(5, 9)), now)
      store.take(report(Life(2, 7), 0, slave(6, 9)), now)
      assert(store.states(life) == Seq(slave(1, 2), slave(0, 3), line(2)))
      assert(store.states(Life(3, 3)).isEmpty)
      assert(store.youngest.map(_.life) == Seq(Life(2, 7), Life(1, 8)))
  }

  "SRV-23: alarms" should "be known by position, with the time of the last one" in fresh { store =>
    def told(position: Int, sequence: Int, state: Int) =
      Event(EventKind.Detector, position, 9, sequence, state)
    store.take(report(life, 0, told(1, 1, DetectorState.Alarm), told(2, 2, 0x82), told(3, 3, 1)), now)
    store.take(report(life, 3, told(1, 4, DetectorState.Alarm)), now.plusSeconds(5))
    store.take(report(life, 4, told(1, 5, DetectorState.Normal)), now.plusSeconds(9))
    assert(store.alarms(1) == Map(1 -> now.plusSeconds(5)) && store.alarms(2).isEmpty)
    assert(store.records(1, 3).map(_.sequence) == Seq(3, 4, 5))
  }

  "SRV-06: events behind missing ones" should "be stored, and the gap be noted, once" in fresh { store =>
    def gaps = store.record(life).get.gaps
    assert(give(store, life, 0, 3) == Seq(0, 1, 2) && gaps == Nil)
    assert(give(store, life, 5, 2) == Seq(5, 6) && gaps == Seq((3, 4)))
    assert(give(store, life, 5, 3) == Seq(7) && gaps == Seq((3, 4)))
    assert(give(store, life, 9, 0) == Nil && gaps == Seq((3, 4), (8, 8)))
    assert(next(store, life).contains(9L))
  }

  "SRV-07: a life that the log does not know" should "begin with its first report; before is a gap" in
    fresh { store =>
      assert(next(store, life).isEmpty)
      assert(give(store, life, 100, 2) == Seq(100, 101))
      assert(store.record(life).get.gaps == Seq((0, 99)))
      assert(give(store, life, 98, 5) == Seq(102))
      give(store, Life(1, 8), 0, 0)
      assert(store.record(Life(1, 8)).contains(LifeRecord(Life(1, 8), 0, Vector.empty)))
    }

  "SRV-08: what is stored" should "be there after a restart" in Directory { d =>
    val path = d.resolve("log.db")
    withStore(path) { store =>
      give(store, life, 10, 1500)
      give(store, Life(2, 1), 0, 0)
      give(store, Life(1, 8), 0, 0)
    }
    withStore(path) { store =>
      assert(store.record(life).contains(LifeRecord(life, 1510, Vector((0, 9)))))
      assert(store.youngest.map(_.life) == Seq(Life(1, 8), Life(2, 1)))
      assert(store.ofLife(life, 1000, 100).map(_.number) == (1000 until 1100))
      assert(give(store, life, 1509, 2) == Seq(1510))
    }
  }

  it should "be readable by others while the server runs" in Directory { d =>
    val path = d.resolve("log.db")
    withStore(path) { store =>
      give(store, life, 0, 2)
      withStore(path)(other => assert(other.latest(10).size == 2))
    }
  }

  "SRV-22: while another program writes" should "be read at once, and nothing be written" in Directory { d =>
    val path = d.resolve("log.db")
    withStore(path) { store =>
      give(store, life, 0, 2)
      Using.resource(DriverManager.getConnection(s"jdbc:sqlite:$path")) { other =>
        other.createStatement.execute("begin immediate")
        assertThrows[SQLException](give(store, life, 2, 1))
        assertThrows[SQLException](store.probe())
        // A reader that waited for the writer would do so each time; a busy machine does not.
        val took = Seq.fill(3) {
          val begin = System.nanoTime()
          assert(store.latest(10).size == 2)
          System.nanoTime() - begin
        }
        assert(took.min < 500000000L)
        other.createStatement.execute("rollback")
      }
      store.probe()
      assert(give(store, life, 2, 1) == Seq(2))
    }
  }

  "SRV-22: a database that is replaced, or is gone" should "not be written any more" in Directory { d =>
    val path = d.resolve("log.db")
    withStore(path) { store =>
      give(store, life, 0, 2)
      withStore(d.resolve("other.db"))(_ => ())
      Files.move(d.resolve("other.db"), path, StandardCopyOption.REPLACE_EXISTING)
      val why = intercept[SQLException](give(store, life, 2, 1)).getMessage
      assert(why.contains("replaced"))
      Files.delete(path)
      assertThrows[SQLException](store.probe())
      assertThrows[SQLException](give(store, life, 2, 1))
    }
  }

  "SRV-18: a database that cannot be used" should "be refused in one sentence" in Directory { d =>
    def refusal(path: Path) =
      EventStore.open(path).fold(identity, s => { s.close(); fail(s"$path was opened") })
    val text = d.resolve("text")
    Files.writeString(text, "This is no database. " * 100)
    val (foreign, older) = (d.resolve("foreign.db"), d.resolve("older.db"))
    for ((file, statement) <- Seq(foreign -> "create table event (x)", older -> "pragma user_version = 1"))
      Using.resource(DriverManager.getConnection(s"jdbc:sqlite:$file"))(_.createStatement.execute(statement))
    for (path <- Seq(d, d.resolve("no/such/directory/log.db"), text, foreign, older)) {
      val sentence = refusal(path)
      assert(sentence.endsWith(".") && !sentence.contains('\n') && sentence.contains(path.toString), sentence)
    }
    assert(refusal(older).contains("earlier version"))
    assert(Files.size(text) == 2100)
  }
}
