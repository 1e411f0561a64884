package flyframe.model

/** What the management bus leads to: PHYs by their addresses, with 32 registers of 16 bits each. */
trait PhyBus {

  /** None: no PHY answers. */
  def read(phy: Int, register: Int): Option[Int]
  def write(phy: Int, register: Int, value: Int): Unit
}

object PhyBus {

  /** No PHY at all. */
  object Empty extends PhyBus {
    def read(phy: Int, register: Int): Option[Int]       = None
    def write(phy: Int, register: Int, value: Int): Unit = ()
  }
}
