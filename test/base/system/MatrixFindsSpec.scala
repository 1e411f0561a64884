package flyframe.system

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.{MasterStatus, SlaveStatus}

/** The fault matrix finds what it is to find: systems with a defect put in by hand, most of them once in an
  * earlier design or in the contract.
  */
class MatrixFindsSpec extends AnyFlatSpec {
  private type Make = (MasterSettings, Long, Bus, Long, () => Unit) => MasterModel

  private lazy val plans = (1 to 6).flatMap(Fault.matrix(5, _))

  private def finds(what: String, make: Plan => SystemModel, found: String*): Unit =
    "The fault matrix" should s"find $what" in {
      val first = plans.iterator.flatMap(FaultMatrixSpec.failure(_, make)).nextOption()
      assert(first.exists(f => found.exists(f.contains)), s"found: $first")
    }

  private def master(what: String, found: String*)(make: Make): Unit =
    finds(s"a master $what", p => new SystemModel(p.size, p.ring, p.seed, makeMaster = make), found: _*)

  master(
    "whose sounder follows from records only",
    "is not heard",
    "the master does not",
    "no fire",
    "stays"
  ) {
    new MasterModel(_, _, _, _, _) {
      override def soundsByState         = false
      override def recordSounds(or: Int) = true
      override def recordFires(or: Int)  = true
    }
  }
  master("that acknowledges records which it does not store", "is not in the log", "keeps") {
    new MasterModel(_, _, _, _, _) {
      override def stores(record: Record) = record.sequence % 5 != 0
    }
  }
  master("whose line waits for the server", "is not heard", "the master does not", "stay") {
    new MasterModel(_, _, _, _, _) {
      override def cycle(at: Long) = if ((status & MasterStatus.Full) == 0) super.cycle(at)
    }
  }
  master("that knows records by number and epoch only", "is not in the log", "keeps") {
    new MasterModel(_, _, _, _, _) {
      override def forgetsRecords               = false
      override def isSame(a: Record, b: Record) = a.sequence == b.sequence && a.epoch == b.epoch
    }
  }
  master("whose sounder ends with the slaves that are left", "nobody has silenced it") {
    new MasterModel(_, _, _, _, _) { override def followsSlaves = true }
  }
  master("which old records set on fire", "fire without an alarm", "no slave does", "stay") {
    new MasterModel(_, _, _, _, _) {
      override def recordSounds(or: Int) = true
      override def recordFires(or: Int)  = true
    }
  }
  master("that keeps orders for absent slaves", "an order of before", "a reset of before") {
    new MasterModel(_, _, _, _, _) { override def forgetsOrders = false }
  }
  finds(
    "a slave whose full queue refuses an alarm",
    p =>
      new SystemModel(
        p.size,
        p.ring,
        p.seed,
        makeSlave = new SlaveModel(_, _, _) { override def keepsAlarms = false }
      ),
    "a full queue refuses"
  )
  finds(
    "a server that stores again what another life of the master reports again",
    p =>
      new SystemModel(
        p.size,
        p.ring,
        p.seed,
        makeServer = new ServerModel(_, _) { override def doubles = true }
      ),
    "is in the log"
  )

  /** What needs other plans: they are right with a good master, and find one with a defect. */
  private def others(name: String, what: String, found: String, plans: => Seq[Plan])(make: Make): Unit =
    name should s"find a master $what" in {
      def run(makeMaster: Make) = plans.iterator
        .flatMap(
          FaultMatrixSpec.failure(_, p => new SystemModel(p.size, p.ring, p.seed, makeMaster = makeMaster))
        )
        .nextOption()
      val none = run(new MasterModel(_, _, _, _, _))
      assert(none.isEmpty, none)
      val failure = run(make)
      assert(failure.exists(_.contains(found)), failure)
    }
  private def directed(what: String, plan: Plan, found: String)(make: Make): Unit =
    others(s"The plan '${plan.name}'", what, found, Seq(plan))(make)
  private def hectic(what: String, found: String)(make: Make): Unit =
    others("What comes at once", what, found, FaultMatrixSpec.hectic(200))(make)

  hectic("that forgets a slave which comes back", "the master does not") {
    new MasterModel(_, _, _, _, _) { override def hearsReturned = false }
  }
  directed(
    "that gives up silence for one who is back, and is silent",
    Fault.backMeanwhile(64),
    "the master does not"
  ) {
    new MasterModel(_, _, _, _, _) {
      override def hearsReturned = false
      override def soundsAgain   = false
    }
  }
  directed("that gives up silence and is silent", Fault.goneMeanwhile(64), "the master does not") {
    new MasterModel(_, _, _, _, _) { override def soundsAgain = false }
  }
  directed("of a ring that hears only one end again", Fault.goneAtOtherEnd(64), "the master does not") {
    new MasterModel(_, _, _, _, _) { override def hearsTogether = false }
  }
  directed("that repeats an order until its effect is seen", Fault.againAtOnce(64), "began later") {
    new MasterModel(_, _, _, _, _) { override def endsOrder = false }
  }
  directed("that keeps a reset in mind", Fault.cutAfterReset(64), "fire ends without a reset") {
    new MasterModel(_, _, _, _, _) { override def forgetsReset = false }
  }
  directed("whose sounder follows records of silenced alarms", Fault.toldAgain(5), "no slave does") {
    new MasterModel(_, _, _, _, _) {
      override def recordSounds(or: Int) = (or & (SlaveStatus.Sounding | SlaveStatus.Alarm)) != 0
    }
  }
  directed("that knows records of before a slave was absent", Fault.smokeTwice(5), "is not in the log") {
    new MasterModel(_, _, _, _, _) { override def forgetsRecords = false }
  }
}
