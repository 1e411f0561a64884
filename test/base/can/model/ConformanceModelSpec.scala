package flyframe.can.model

import flyframe.can._
import flyframe.params.CanParams

/** The suites that run on any controller, on the golden model. */
trait OnModel { self: CanCases =>
  protected def withDevice(p: CanParams)(body: CanUnderTest => Unit): Unit = body(new CanPortModel(p))
}

class ReceptionModelSpec       extends ReceptionCases with OnModel
class ReceiverErrorModelSpec   extends ReceiverErrorCases with OnModel
class PassiveReceiverModelSpec extends PassiveReceiverCases with OnModel
class RecModelSpec             extends RecCases with OnModel
class ReceiverTimingModelSpec  extends ReceiverTimingCases with OnModel
class SendingModelSpec         extends SendingCases with OnModel
class SenderErrorModelSpec     extends SenderErrorCases with OnModel
class PassiveSenderModelSpec   extends PassiveSenderCases with OnModel
class TecModelSpec             extends TecCases with OnModel
class SenderTimingModelSpec    extends SenderTimingCases with OnModel

class RingPortModelSpec extends RingPortRules {
  protected def withDevice(p: CanParams)(body: CanUnderTest => Unit): Unit =
    body(new CanPortModel(p, isTolerant = false))
}

class TimingRulesModelSpec    extends TimingRules with OnModel
class FrameRulesModelSpec     extends FrameRules with OnModel
class ErrorRulesModelSpec     extends ErrorRules with OnModel
class SlotRulesModelSpec      extends SlotRules with OnModel
class ReceptionRulesModelSpec extends ReceptionRules with OnModel
class SigrokModelSpec         extends SigrokCases with OnModel
