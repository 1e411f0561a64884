package flyframe.system

import scala.collection.mutable
import scala.util.Random

/** A whole alarm system: line or ring, master with panel, plant network, server. It jumps over bus cycles in
  * which nothing can change: after a whole turn of the scanner without a change, each further cycle is the
  * same, until something happens at its time.
  *
  * @param makeMaster
  *   the master to be tried; by settings, life, line, time
  * @param makeServer
  *   the server to be tried
  * @param ticks
  *   it has to do something at times without reports
  */
class SystemModel(
    val size: Int,
    ring: Boolean,
    seed: Long,
    cycle: Long = 5000,
    makeMaster: (MasterSettings, Long, Bus, Long, () => Unit) => MasterModel = new MasterModel(_, _, _, _, _),
    makeServer: (Random, () => Unit) => AlarmServer = new ServerModel(_, _),
    makeSlave: (Int, Int, SlaveWatcher) => SlaveModel = new SlaveModel(_, _, _),
    ticks: Boolean = false
) {
  private val random  = new Random(seed)
  private var version = 0L

  var now = 0L

  val nodes: IndexedSeq[Int] = Vector.tabulate(size)(101 + _)

  val monitor: Monitor = new Monitor(this, () => version += 1)

  /** By number; places on the line can be changed. */
  val slaves: IndexedSeq[SlaveModel] = nodes.zipWithIndex.map { case (id, i) => makeSlave(i, id, monitor) }

  val line           = new AlarmLineModel(slaves.toArray, ring, random, () => version += 1)
  val server         = makeServer(new Random(seed + 1), () => version += 1)
  private val setup  = MasterSettings(nodes, ring, cycle)
  private var forged = 0.0

  private var starts = 0

  /** The low half of a life goes to the slaves, and is counted: it must be another one. */
  private def start() = {
    starts += 1
    makeMaster(setup, random.nextLong() << 16 | starts, line, now, () => version += 1)
  }

  /** None while it is off. */
  var master: Option[MasterModel] = None
  private var nextCycle           = 0L

  private final class Due(val at: Long, val order: Long, val action: () => Unit)
  private val agenda = mutable.PriorityQueue.empty[Due](Ordering.by(d => (-d.at, -d.order)))
  private var orders = 0L

  /** Cycles that were gone through, and all. */
  var worked = 0L
  var cycles = 0L

  /** Does something at a time. */
  def at(time: Long)(action: => Unit): Unit = {
    orders += 1
    agenda.enqueue(new Due(time max now, orders, () => action))
  }

  for (i <- 0 until size) line.power(slaves(i), on = true)
  master = Some(start())
  monitor.masterStarted()

  /** Something happens from outside. */
  def act(what: Act): Unit = {
    what match {
      case Act.Cable(c, isWhole) => line.cable(c, isWhole)
      case Act.Power(p, on)      => line.power(slaves(p), on)
      case Act.Host(p, after)    => slaves(p).stopHost(after)
      case Act.Boot(p, time)     => slaves(p).setBoot(time)
      case Act.Flap(p, s, half)  => slaves(p).flap(s, half)
      case Act.Smoke(p, on)      => slaves(p).setSmoke(on)
      case Act.Node(p, id)       => monitor.moves = true; slaves(p).rename(id)
      case Act.Mode(p, m, s)     => slaves(p).setMode(m, s)
      case Act.Swap(a, b)        => line.swap(a, b); monitor.moved()
      case Act.Noise(c, rate)    => line.noise(c, rate)
      case Act.Server(state)     => server.set(state); monitor.serverChanged(state)
      case Act.Forge(share)      => forged = share; monitor.forgedChanged(share)
      case Act.Restart(time)     => restart(time)
      case Act.Silence           => press(_.silence(now), monitor.silencePressed())
      case Act.Reset             => press(_.reset(now), monitor.resetPressed())
      case Act.Page(order)       => server.order(order)
    }
    version += 1
    what match {
      case _: Act.Cable | _: Act.Power | _: Act.Swap | _: Act.Noise => monitor.disturbed()
      case _                                                        =>
    }
    monitor.reachChanged()
  }

  private def press(button: MasterModel => Unit, note: => Unit): Unit = master.foreach { m =>
    note
    button(m)
  }

  private def restart(time: Long): Unit = {
    master = None
    monitor.masterStopped()
    at(now + time) {
      if (master.isEmpty) {
        master = Some(start())
        nextCycle = now
        monitor.masterStarted()
        version += 1
      }
    }
  }

  /** Does all of a plan's acts at their times, and lets time pass to its end. */
  def run(plan: Plan): Unit = {
    monitor.faultFrom = plan.faultFrom
    for ((time, what) <- plan.acts) at(time)(act(what))
    run(plan.end)
  }

  private var quietFrom = -1L // version at which the cycles without change began
  private var quiet     = 0

  /** Cycles without a change after which the next ones are the same. */
  private val turn = size / MasterModel.Reads + 24

  /** Lets time pass. */
  def run(until: Long): Unit = while (now < until) {
    var due = until
    if (agenda.nonEmpty) due = due min agenda.head.at
    var i = 0
    while (i < size) {
      due = due min slaves(i).due
      i += 1
    }
    master.foreach { m =>
      due = due min m.due
      if (quiet < turn || line.isNoisy) due = due min nextCycle
    }
    due = due max now
    if (due > now) {
      monitor.look(due)
      now = due
      line.now = now
    }
    pass()
    if (agenda.nonEmpty && agenda.head.at <= now) {
      while (agenda.nonEmpty && agenda.head.at <= now) agenda.dequeue().action()
      pass()
    }
    master.foreach { m =>
      if (nextCycle < now) {
        // What was left out.
        val left = (now - nextCycle + cycle - 1) / cycle
        if (quiet >= turn) {
          m.skip(left)
          line.skip(left)
        }
        cycles += left
        nextCycle += left * cycle
      }
      if (nextCycle == now) {
        m.cycle(now)
        worked += 1
        cycles += 1
        nextCycle += cycle
        monitor.cycled()
        if (version == quietFrom) quiet += 1
        else {
          quietFrom = version
          quiet = 0
        }
      }
      send(m)
      while (m.mailbox.nonEmpty) {
        val order = m.mailbox.dequeue()
        order.order match {
          case flyframe.protocol.Order.Silence => act(Act.Silence)
          case flyframe.protocol.Order.Reset   => act(Act.Reset)
          case _                               =>
        }
        m.commanded(order, flyframe.protocol.CommandResult.Done)
      }
    }
    if (version != quietFrom) quiet = 0
  }

  private def pass(): Unit = {
    var i = 0
    while (i < size) {
      slaves(i).advance(now)
      i += 1
    }
  }

  private def delay() = 200L + random.nextInt(1800)

  /** What the server has answered comes to the master that is there then. */
  private def answers(): Unit = for (a <- server.answers() if random.nextDouble() >= forged)
    at(now + delay())(master.foreach(_.answer(a, now)))

  private def tick(): Unit = at(now + SystemModel.Tick) {
    server.tick(now)
    answers()
    tick()
  }
  if (ticks) tick()

  private def send(m: MasterModel): Unit = m.report(now).foreach { r =>
    if (random.nextDouble() >= forged) at(now + delay()) {
      server.report(r, genuine = true, now)
      answers()
      if (forged > 0) {
        // Two of the many.
        server.report(r.copy(counter = r.counter + 1000, status = 0), genuine = false, now)
        m.answer(Answer(genuine = false, r.life, r.server, r.counter, r.number + 1000), now)
      }
    }
    if (forged > 0)
      m.answer(Answer(genuine = false, r.life, r.server, r.counter, r.number + r.events.size), now)
  }
}

object SystemModel {

  /** Time between two ticks of a server, in us. */
  val Tick = 500000L
}
