package flyframe.fibre

import flyframe.params.FibreParams

/** The suites that run on any node, on the RTL. */
trait OnRtl { self: FibreCases =>
  protected def withNodes(p: FibreParams, count: Int)(body: IndexedSeq[FibreUnderTest] => Unit): Unit =
    FibreSimulation(p, count)(body)
}

class ModemRtlSpec extends ModemRules with OnRtl
class PortRtlSpec  extends PortRules with OnRtl
class BusRtlSpec   extends BusModeRules with OnRtl
class GuardRtlSpec extends GuardRules with OnRtl
