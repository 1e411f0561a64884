package flyframe.device

import scala.xml._
import flyframe.params.EscParams

/** The ESI file (EtherCAT slave information, ETG.2000) of a device, for master and configuration tools. The
  * order of the elements is that of the schema EtherCATInfo.xsd.
  */
object Esi {
  private val SchemaVersion = "1.9"
  private val English       = "1033"

  private def x(v: Long, digits: Int): String = s"#x%0${digits}x".format(v)
  private def x16(v: Int): String             = x(v.toLong, 4)
  private def x8(v: Int): String              = x(v.toLong, 2)
  private def bool(b: Boolean): String        = if (b) "1" else "0"

  private def hexBinary(words: Seq[Int]): String = words.map(w => f"${w & 0xff}%02X${w >> 8}%02X").mkString

  /** The text of the ESI file for device `d`, which must have passed [[DeviceCheck]], on a controller with
    * parameters `p`, `fmmus` FMMUs and `syncManagers` SyncManagers.
    */
  def xml(d: Device, p: EscParams, fmmus: Int, syncManagers: Int): String = {
    // Wide: the printer would break long texts.
    val printer = new PrettyPrinter(100000, 2)
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n" + printer.format(info(d, p, fmmus, syncManagers)) + "\n"
  }

  private def info(d: Device, p: EscParams, fmmus: Int, syncManagers: Int): Elem =
    <EtherCATInfo xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
                  xsi:noNamespaceSchemaLocation="EtherCATInfo.xsd"
                  Version={SchemaVersion}>
      <Vendor>
        <Id>{x(d.vendor.id, 8)}</Id>
        <Name>{d.vendor.name}</Name>
      </Vendor>
      <Descriptions>
        <Groups>
          <Group>
            <Type>{d.group.kind}</Type>
            <Name LcId={English}>{d.group.name}</Name>
          </Group>
        </Groups>
        <Devices>{device(d, p, fmmus, syncManagers)}</Devices>
      </Descriptions>
    </EtherCATInfo>

  private def device(d: Device, p: EscParams, fmmus: Int, syncManagers: Int): Elem =
    <Device Physics={"Y" * p.ports}>
      <Type ProductCode={x(d.product.code, 8)} RevisionNo={x(d.product.revision, 8)}>{d.product.order}</Type>
      <Name LcId={English}>{d.product.name}</Name>
      <Info>
        <EtherCATController>
          <DpramSize>{p.ramBytes}</DpramSize>
          <SmCount>{syncManagers}</SmCount>
          <FmmuCount>{fmmus}</FmmuCount>
        </EtherCATController>
        {Seq.fill(p.ports)(<Port><Type>MII</Type></Port>)}
      </Info>
      <GroupType>{d.group.kind}</GroupType>
      {d.fmmus.map(f => <Fmmu>{f.esi}</Fmmu>)}
      {d.syncManagers.map(syncManager)}
      {d.rxPdos.map(pdo(d, "RxPdo", _))}
      {d.txPdos.map(pdo(d, "TxPdo", _))}
      {d.mailbox.toSeq.map(mailbox)}
      {if (d.dcModes.isEmpty) NodeSeq.Empty else <Dc>{d.dcModes.map(dcMode)}</Dc>}
      {eeprom(d)}
    </Device>

  private def syncManager(s: SyncManager): Elem =
    if (s.use == SmUse.Unused) <Sm Enable="0"></Sm>
    else {
      val size = s.size.toString
      <Sm MinSize={size} MaxSize={size} DefaultSize={size} StartAddress={x16(s.start)} ControlByte={
        x8(s.control)
      } Enable="1">{s.use.esi}</Sm>
    }

  /** Fixed and mandatory, unless masters may change mapping and assignment. */
  private def pdo(d: Device, element: String, p: Pdo): Elem = {
    def fixed(feature: CoeFeature) = bool(!d.mailbox.exists(_.coe(feature)))
    val content = <_>
      <Index>{x16(p.index)}</Index>
      <Name>{p.name}</Name>
      {p.entries.map(entry)}
    </_>
    content.copy(
      label = element,
      attributes = new UnprefixedAttribute(
        "Fixed",
        fixed(CoeFeature.PdoConfig),
        new UnprefixedAttribute(
          "Mandatory",
          fixed(CoeFeature.PdoAssign),
          new UnprefixedAttribute("Sm", p.syncManager.toString, Null)
        )
      )
    )
  }

  private def entry(e: PdoEntry): Elem = e.dataType match {
    case None =>
      <Entry>
        <Index>#x0</Index>
        <BitLen>{e.bits}</BitLen>
      </Entry>
    case Some(t) =>
      <Entry>
        <Index>{x16(e.index)}</Index>
        <SubIndex>{e.subIndex}</SubIndex>
        <BitLen>{e.bits}</BitLen>
        <Name>{e.name}</Name>
        <DataType>{t.name}</DataType>
      </Entry>
  }

  private def mailbox(m: Mailbox): Elem = {
    val protocols = MailboxProtocol.all.filter(m.protocols).map {
      case MailboxProtocol.CoE =>
        CoeFeature.all.foldLeft(<CoE/>)((e, f) => e % new UnprefixedAttribute(f.esi, bool(m.coe(f)), Null))
      case other => <p/>.copy(label = other.name)
    }
    <Mailbox DataLinkLayer={bool(m.repeat)}>{protocols}</Mailbox>
  }

  private def dcMode(m: DcMode): Elem =
    <OpMode>
      <Name>{m.name}</Name>
      <Desc>{m.description}</Desc>
      <AssignActivate>{x16(m.assignActivate)}</AssignActivate>
      <CycleTimeSync0 Factor={m.cycleFactor0.toString}>{m.cycleTime0}</CycleTimeSync0>
      <ShiftTimeSync0>{m.shiftTime0}</ShiftTimeSync0>
      <CycleTimeSync1 Factor={m.cycleFactor1.toString}>0</CycleTimeSync1>
      <ShiftTimeSync1>{m.shiftTime1}</ShiftTimeSync1>
    </OpMode>

  private def eeprom(d: Device): Elem = {
    val boot = d.mailbox.flatMap(_.bootstrap).toSeq.map { b =>
      val words = Seq(b.receive.start, b.receive.size, b.send.start, b.send.size)
      <BootStrap>{hexBinary(words)}</BootStrap>
    }
    <Eeprom>
      <ByteSize>{d.eepromBytes}</ByteSize>
      <ConfigData>{hexBinary(d.configuration.words)}</ConfigData>
      {boot}
    </Eeprom>
  }
}
