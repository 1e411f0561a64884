package flyframe.can.model

import flyframe.can._

/** [[BridgeRules]] on the golden model. */
class BridgeModelSpec extends BridgeRules {
  import BridgeUnderTest._

  protected def withBridge(body: BridgeUnderTest => Unit): Unit = {
    val ports = Seq.fill(4)(new CanPortModel(params))
    ports(F).bridges = ports(T).bridged
    ports(T).bridges = ports(F).bridged
    body(new BridgeUnderTest {
      def write(port: Int, address: Int, bytes: Seq[Int]): Unit = ports(port).write(address, bytes)
      def read(port: Int, address: Int, count: Int): Seq[Int]   = ports(port).read(address, count)
      def cycle: Long                                           = ports(F).cycle
      def run(cycles: Int): Unit = for (_ <- 0 until cycles) {
        val f = ports(F).driven && ports(OnF).driven
        val t = ports(T).driven && ports(OnT).driven
        for (p <- Seq(F, OnF)) ports(p).step(f)
        for (p <- Seq(T, OnT)) ports(p).step(t)
      }
    })
  }
}
