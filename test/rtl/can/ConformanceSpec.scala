package flyframe.can

import flyframe.params.CanParams

/** The suites that run on any controller, on the RTL. */
trait OnRtl { self: CanCases =>
  protected def withDevice(p: CanParams)(body: CanUnderTest => Unit): Unit = CanSimulation(p)(body)
}

class ReceptionSpec       extends ReceptionCases with OnRtl
class ReceiverErrorSpec   extends ReceiverErrorCases with OnRtl
class PassiveReceiverSpec extends PassiveReceiverCases with OnRtl
class RecSpec             extends RecCases with OnRtl
class ReceiverTimingSpec  extends ReceiverTimingCases with OnRtl
class SendingSpec         extends SendingCases with OnRtl
class SenderErrorSpec     extends SenderErrorCases with OnRtl
class PassiveSenderSpec   extends PassiveSenderCases with OnRtl
class TecSpec             extends TecCases with OnRtl
class SenderTimingSpec    extends SenderTimingCases with OnRtl

class RingPortSpec extends RingPortRules {
  protected def withDevice(p: CanParams)(body: CanUnderTest => Unit): Unit =
    CanSimulation(p, isTolerant = false)(body)
}

class ErrorRulesSpec     extends ErrorRules with OnRtl
class FrameRulesSpec     extends FrameRules with OnRtl
class ReceptionRulesSpec extends ReceptionRules with OnRtl
class SlotRulesSpec      extends SlotRules with OnRtl
class TimingRulesSpec    extends TimingRules with OnRtl
class SigrokSpec         extends SigrokCases with OnRtl
