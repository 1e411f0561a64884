package flyframe.model

import flyframe.params.EscParams
import flyframe.registers.Register

/** What becomes of the link inputs (LNK-01 to LNK-12, B-93 to B-97): MI link detection, then enhanced link
  * detection. A poll of all PHYs takes a millisecond at most; errors close a port if they come at once.
  *
  * @param phys
  *   gives what the management bus leads to
  * @param isOn
  *   whether enhanced link detection is on at a port
  */
class LinkModel(p: EscParams, phys: () => PhyBus, isOn: Int => Boolean) extends ModelUnit {
  private class Port(number: Int) {
    var input     = true
    var fell      = false                // and has not come back since (LNK-03)
    var poll      = Option.empty[Polled] // None: the PHY could not be read (LNK-04)
    var pollError = false
    var rewritten = false
    var held      = false                // by enhanced link detection, until the link goes (LNK-09)
    var window    = 0                    // RX_ER in this interval
    var inReset   = 0                    // ms

    private val address = p.phyAddress(number)
    private val fibre   = p.isFx(number)

    def found: Boolean = poll match {
      case Some(Polled(_, suits, _)) => suits && !fell
      case None                      => input
    }
    def link: Boolean  = found && !held
    def settle(): Unit = if (!found) held = false

    private def hasLink(status: Int): Boolean = (status & 4) != 0

    def ask(): Unit = {
      val result = for {
        // B-93: nothing is known of it, or its link has gone since it was asked last.
        unsure  <- if (poll.exists(_.link)) phys().read(address, 1).map(!hasLink(_)) else Some(poll.isEmpty)
        _       <- if (unsure) configure() else Some(())
        status  <- current()
        partner <- if (fibre) Some(0) else phys().read(address, 5)
      } yield {
        val link       = hasLink(status)
        val negotiated = fibre || (status & 0x20) != 0
        val fullTx     = fibre || (partner & 0x100) != 0
        Polled(link, link && negotiated && fullTx, link && negotiated && !fullTx)
      }
      poll = result
      if (result.isEmpty) pollError = true
      if (result.exists(!_.link)) fell = false
      settle()
    }

    /** Register 1 with the link of now: a low bit may be that of earlier, until it has been read (B-94). */
    private def current(): Option[Int] =
      phys().read(address, 1).flatMap(s => if (hasLink(s)) Some(s) else phys().read(address, 1))

    /** LNK-06: what must not be is rewritten, and auto-negotiation begun anew. None: it cannot be read, or is
      * still in its reset.
      */
    private def configure(): Option[Unit] = {
      var touched = false
      def check(register: Int, value: Int)(right: Int => Boolean): Option[Unit] =
        phys().read(address, register).filter(v => register != 0 || (v & 0x8000) == 0).map { present =>
          if (!right(present)) {
            phys().write(address, register, value)
            touched = true
          }
        }
      val done =
        if (fibre) check(0, 0x2100)(v => (v & 0x7d40) == 0x2100)
        else
          for {
            _ <- check(9, 0)(v => (v & 0x300) == 0)
            _ <- check(4, 0x0101)(v => (v & 0x3e0) == 0x100)
            _ <- check(0, 0x1200)(v => !touched && (v & 0x5c00) == 0x1000)
          } yield ()
      rewritten |= touched
      done
    }

    def close(): Unit = {
      held = true
      if (p.resetsPhys) inReset = 3 else phys().write(address, 0, 0x1200)
    }
  }
  private val ports = Vector.tabulate(p.ports)(new Port(_))

  /** The link input changes. */
  def signal(port: Int, up: Boolean): Unit = {
    val it = ports(port)
    it.fell = !up && (it.fell || it.input)
    it.input = up
    it.settle()
  }

  /** A port's link before enhanced link detection, and behind it. */
  def found(port: Int): Boolean = ports(port).found
  def link(port: Int): Boolean  = ports(port).link

  /** A bit per port whose PHY is held in reset (LNK-10). */
  def resets: Int = ports.zipWithIndex.map { case (it, y) => if (it.inReset > 0) 1 << y else 0 }.sum

  /** Symbols with RX_ER, close together. */
  def errors(port: Int, symbols: Int): Unit = if (p.hasEnhancedLinks) {
    val it = ports(port)
    it.window += symbols
    if (it.window >= 32 && isOn(port) && it.link) it.close()
  }

  /** A millisecond or more passes. */
  def advanceMs(ms: Int): Unit = ports.foreach { it =>
    it.window = 0
    it.inReset = (it.inReset - ms).max(0)
    if (p.hasMiLinks) it.ask()
  }

  def advanceUs(us: Int): Unit = if (us >= 10) ports.foreach(_.window = 0)

  override def status(field: String): Option[Int] = field match {
    case "enhanced_link_detection"  => Some(if ((0 until 4).exists(isOn)) 1 else 0)
    case LinkModel.Name(name, port) => Some(if (shown(name, ports(port.toInt))) 1 else 0)
    case _                          => None
  }

  private def shown(name: String, it: Port): Boolean = name match {
    case "physical_link" => it.poll.exists(_.link)
    case "link"          => it.poll.exists(_.suits)
    case "link_error"    => it.poll.exists(r => r.link && !r.suits)
    case "partner_error" => it.poll.exists(_.partner)
    case "poll_error"    => it.pollError
    case "configured"    => it.rewritten
  }

  override def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit =
    if (register.name.matches("mi_port\\d")) ports.foreach { it =>
      it.pollError = false
      it.rewritten = false
    }
}

/** What a PHY has told: a link, one that suits EtherCAT, and a partner that is to blame if not. */
final case class Polled(link: Boolean, suits: Boolean, partner: Boolean)

object LinkModel {
  private val Name = "mi_(.*)_port(\\d)".r
}
