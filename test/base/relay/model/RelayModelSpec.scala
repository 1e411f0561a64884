package flyframe.relay.model

import flyframe.Tier
import flyframe.relay._

/** The suites that run on any node, on the golden model. */
trait OnModel { self: RelayCases =>
  protected def withNode(body: RelayUnderTest => Unit): Unit = body(new RelayModel)
}

class LinkModelSpec    extends RelayCases with LinkRules with OnModel
class ConfirmModelSpec extends RelayCases with ConfirmRules with OnModel
class ReceiveModelSpec extends RelayCases with ReceiveRules with OnModel
class StartModelSpec   extends RelayCases with StartRules with OnModel

class MutationModelSpec extends RelayCases with MutationRules with OnModel {
  protected def mutations =
    Tier("Broken and forged frames of relay mode", "frames", test = 2000, soak = 1000000)
}
