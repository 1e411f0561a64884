package flyframe.fibre.model

import flyframe.fibre._
import flyframe.params.FibreParams

/** The suites that run on any node, on the golden model. */
trait OnModel { self: FibreCases =>
  protected def withNodes(p: FibreParams, count: Int)(body: IndexedSeq[FibreUnderTest] => Unit): Unit =
    body(IndexedSeq.fill(count)(new RingPortsModel(p)))
}

class ModemModelSpec extends ModemRules with OnModel
class PortModelSpec  extends PortRules with OnModel
class BusModelSpec   extends BusModeRules with OnModel
class GuardModelSpec extends GuardRules with OnModel
class ReachSpec      extends ReachCases
