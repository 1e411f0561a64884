package flyframe.relay

import flyframe.params.CanParams

/** Keeps what a receiver tells until the end of the bit (RB-21). */
private class AtEndOfBit(to: LinkListener) extends LinkListener {
  private var kept = Vector.empty[() => Unit]

  def tell(): Unit = {
    val all = kept
    kept = Vector.empty
    all.foreach(_())
  }
  def forget(): Unit                                   = kept = Vector.empty
  def starts(): Unit                                   = kept :+= (() => to.starts())
  def header(header: LinkHeader, body: LinkBody): Unit = kept :+= (() => to.header(header, body))
  def identified(): Unit                               = kept :+= (() => to.identified())
  def ended(isGood: Boolean): Unit                     = kept :+= (() => to.ended(isGood))
  def badHeader(): Unit                                = kept :+= (() => to.badHeader())
  def badFrame(): Unit                                 = kept :+= (() => to.badFrame())
}

/** The golden model of relay mode, core cycle by core cycle. */
class RelayModel(p: CanParams = CanParams()) extends RelayUnderTest {
  private val links = new LinkSenders {
    def quiet(port: Int): Long                                     = outputs(port).quiet
    def begin(port: Int, header: LinkHeader, body: LinkBody): Unit = outputs(port).begin(header, body)
    def abort(port: Int): Unit                                     = outputs(port).abort()
    def silence(port: Int): Unit                                   = outputs(port).silence()
  }
  private lazy val outputs = Seq.fill(2)(new LinkSenderModel)
  val node: RelayNodeModel = new RelayNodeModel(p, links)
  val host: RelayHostModel = new RelayHostModel(p, node)
  private val told         = (0 to 1).map(port => new AtEndOfBit(node.listener(port)))
  private val receivers    = told.map(new LinkReceiverModel(_))
  private var bitCycles    = 0
  private var inBit        = 0                 // cycles of the present bit
  private val inputs       = new Array[LinkInputModel](2)
  private val levels       = Array(true, true)
  private val decided      = Array(true, true) // of the bit behind (RB-19)
  private val wasUp        = Array(false, false)
  private var cycles       = 0L
  setBit()

  private def setBit(): Unit = if (host.linkBit != bitCycles) {
    bitCycles = host.linkBit
    inBit = 0
    for (port <- 0 to 1) restart(port)
  }

  private def restart(port: Int): Unit =
    inputs(port) = new LinkInputModel(LinkTiming(bitCycles), receivers(port))

  def cycle: Long                 = cycles
  def level(port: Int): Boolean   = levels(port)
  def isStuck(port: Int): Boolean = receivers(port).isStuck

  def step(heard: (Boolean, Boolean), up: (Boolean, Boolean)): Unit = {
    node.now(cycles)
    if (inBit == 0) {
      port(0, up._1)
      port(1, up._2)
    }
    // In bus mode the links are silent (RB-25).
    inputs(0).step(heard._1 || !wasUp(0) || !node.isOn)
    inputs(1).step(heard._2 || !wasUp(1) || !node.isOn)
    inBit += 1
    if (inBit == bitCycles) {
      inBit = 0
      told.foreach(_.tell())
      node.tick()
      for (port <- 0 to 1) {
        levels(port) = decided(port)
        decided(port) = outputs(port).send()
      }
    }
    cycles += 1
  }

  private def port(port: Int, isUp: Boolean): Unit = if (isUp != wasUp(port)) {
    wasUp(port) = isUp
    told(port).forget() // what came in a bit that was cut (RB-20)
    node.listener(port).ended(isGood = false)
    receivers(port).restart()
    restart(port)
    node.portChanges(port, isUp)
  }

  def write(address: Int, bytes: Seq[Int]): Unit = {
    node.now(cycles)
    val wasOn = node.isOn
    host.write(address, bytes)
    if (!node.isOn) told.foreach(_.forget())
    else if (!wasOn) for (port <- 0 to 1) {
      receivers(port).restart()
      restart(port)
    }
    setBit()
  }

  def read(address: Int, count: Int): Seq[Int] = {
    node.now(cycles)
    host.read(address, count)
  }
}
