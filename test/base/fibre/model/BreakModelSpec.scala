package flyframe.fibre.model

import flyframe.Tier
import flyframe.fibre._

/** Breaks of a ring of golden models, at 125 kbit/s and 50 MHz. */
class BreakModelSpec extends BreakCases {
  protected val positions: Tier = Tier("Breaks of a ring in bus mode", "breaks", test = 4, soak = 400)

  protected def onRing(home: Boolean, first: Int)(body: CanOnRing => Unit): Unit =
    body(new CanRing(8, Option.when(home)(0), Seq.fill(8)(100L), 16, firstAddress = first))
}
