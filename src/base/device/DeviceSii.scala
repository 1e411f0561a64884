package flyframe.device

/** The SII image of a device. */
object DeviceSii {

  /** As the images of Beckhoff's terminals have it: mandatory, contents fixed. */
  private val PdoFlags = 0x0011
  private val Version  = 1
  private val Mii      = 1

  /** The texts of the SII. The order number comes first: SOEM and ethercrab take text 1 as the device's name,
    * whatever the general category says.
    */
  def strings(d: Device): Seq[String] =
    (Seq(d.product.order, d.group.kind, d.group.name, d.product.name) ++
      d.pdos.flatMap(p => p.name +: p.entries.map(_.name)) ++
      d.dcModes.flatMap(m => Seq(m.name, m.description))).filter(_.nonEmpty).distinct

  /** The image for device `d`, which must have passed [[DeviceCheck]], on a controller with `ports` ports
    * with MII or RMII (1 to 4).
    */
  def image(d: Device, ports: Int): SiiImage = {
    val texts                  = strings(d)
    def number(t: String): Int = texts.indexOf(t) + 1
    def kilobits               = d.eepromBytes / 128
    SiiImage(header(d, kilobits), categories(d, ports, texts, number), d.eepromBytes)
  }

  private def header(d: Device, kilobits: Int) = {
    val none = SyncManager(SmUse.Unused, 0, 0, 0)
    val out  = d.syncManager(SmUse.MailboxOut).getOrElse(none)
    val in   = d.syncManager(SmUse.MailboxIn).getOrElse(none)
    SiiHeader(
      d.configuration.words,
      None,
      d.vendor.id,
      d.product.code,
      d.product.revision,
      d.product.serial,
      d.mailbox
        .flatMap(_.bootstrap)
        .map(b => SiiMailbox(b.receive.start, b.receive.size, b.send.start, b.send.size))
        .getOrElse(SiiMailbox.none),
      SiiMailbox(out.start, out.size, in.start, in.size),
      d.mailbox.toSeq.flatMap(_.protocols).map(_.bit).sum,
      Map.empty,
      kilobits,
      Version
    )
  }

  private def general(d: Device, ports: Int, number: String => Int) = {
    val protocols               = d.mailbox.toSeq.flatMap(_.protocols)
    def has(p: MailboxProtocol) = if (protocols.contains(p)) 1 else 0
    SiiGeneral(
      group = number(d.group.kind),
      image = 0,
      order = number(d.product.order),
      name = number(d.product.name),
      coe = has(MailboxProtocol.CoE) | d.mailbox.toSeq.flatMap(_.coe).map(_.bit).sum,
      foe = has(MailboxProtocol.FoE),
      eoe = has(MailboxProtocol.EoE),
      soeChannels = has(MailboxProtocol.SoE),
      ds402Channels = 0,
      sysmanClass = 0,
      flags = if (d.mailbox.exists(_.repeat)) 4 else 0,
      current = 0,
      groupName = number(d.group.name),
      ports = (0 until ports).map(i => Mii << 4 * i).sum
    )
  }

  private def pdo(p: Pdo, number: String => Int) = SiiPdo(
    p.index,
    p.syncManager,
    0,
    number(p.name),
    PdoFlags,
    p.entries.map { e =>
      SiiPdoEntry(e.index, e.subIndex, number(e.name), e.dataType.map(_.code).getOrElse(0), e.bits, 0)
    }
  )

  private def categories(d: Device, ports: Int, texts: Seq[String], number: String => Int): Seq[SiiCategory] =
    Seq(SiiStrings(texts), general(d, ports, number)) ++
      Option.when(d.fmmus.nonEmpty)(SiiFmmus(d.fmmus.map(_.code).padTo((d.fmmus.size + 1) / 2 * 2, 0xff))) ++
      Option.when(d.syncManagers.nonEmpty)(SiiSyncManagers(d.syncManagers.map { s =>
        SiiSyncManager(s.start, s.size, s.control, 0, if (s.use == SmUse.Unused) 0 else 1, s.use.code)
      })) ++
      Option.when(d.txPdos.nonEmpty)(SiiPdos(tx = true, d.txPdos.map(pdo(_, number)))) ++
      Option.when(d.rxPdos.nonEmpty)(SiiPdos(tx = false, d.rxPdos.map(pdo(_, number)))) ++
      Option.when(d.dcModes.nonEmpty)(SiiDcModes(d.dcModes.map { m =>
        SiiDcMode(
          m.cycleTime0,
          m.shiftTime0,
          m.shiftTime1,
          m.cycleFactor1,
          m.assignActivate,
          m.cycleFactor0,
          number(m.name),
          number(m.description)
        )
      }))
}
