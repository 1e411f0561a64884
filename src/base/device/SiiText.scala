package flyframe.device

import flyframe.registers.SiiRegisters

/** An SII image as a person reads it. */
object SiiText {
  private def h16(v: Int): String  = f"0x$v%04x"
  private def h32(v: Long): String = f"0x$v%08x"
  private def quoted(t: String)    = if (t.isEmpty) "" else s" \"$t\""

  private val configurationNames = Seq(
    "PDI control, ESC configuration A0",
    "PDI configuration",
    "SYNC pulse length, 10 ns",
    "extended PDI configuration",
    "station alias",
    "ESC configuration A5",
    "ESC configuration A6"
  )

  /** Several lines, each ended. */
  def print(image: SiiImage): String =
    (header(image) ++ image.categories.flatMap(c => s"${title(c)}" +: category(c, image).map("  " + _)))
      .mkString("", "\n", "\n")

  private def title(c: SiiCategory) = c match {
    case SiiOther(code, bytes) => s"Category ${h16(code)}, ${bytes.size} bytes, not interpreted"
    case _                     => SiiCategory.name(c.code)
  }

  private def header(image: SiiImage): Seq[String] = {
    val h = image.header
    val checksum = h.checksum match {
      case Some(SiiRegisters.ChecksumOff) => "check switched off"
      case _                              => "checksum good"
    }
    def mailbox(m: SiiMailbox) =
      if (m == SiiMailbox.none) "none"
      else
        s"receive ${h16(m.receiveStart)}, ${m.receiveSize} bytes; " +
          s"send ${h16(m.sendStart)}, ${m.sendSize} bytes"
    val protocols = MailboxProtocol.all.filter(p => (h.protocols & p.bit) != 0).map(_.name)
    Seq(s"SII image, ${image.bytes} bytes, $checksum", "Configuration") ++
      configurationNames.zip(h.configuration).map { case (n, v) => s"  ${h16(v)}  $n" } ++
      Seq(
        "Identity",
        s"  vendor ${h32(h.vendor)}, product ${h32(h.product)}, revision ${h32(h.revision)}, " +
          s"serial ${h32(h.serial)}",
        "Mailbox",
        s"  bootstrap: ${mailbox(h.bootstrap)}",
        s"  standard: ${mailbox(h.mailbox)}",
        s"  protocols: ${if (protocols.isEmpty) "none" else protocols.mkString(", ")}",
        s"EEPROM ${h.sizeKbit} Kbit, SII version ${h.version}"
      ) ++
      h.others.toSeq.sorted.map { case (a, v) => s"Word ${h16(a)} is ${h16(v)}" }
  }

  private def category(c: SiiCategory, image: SiiImage): Seq[String] = c match {
    case SiiStrings(texts, _) => texts.zipWithIndex.map { case (t, i) => f"${i + 1}%3d  $t" }
    case g: SiiGeneral =>
      Seq(
        s"group${quoted(image.text(g.group))}${quoted(image.text(g.groupName))}, order${quoted(
            image.text(g.order)
          )}, name${quoted(image.text(g.name))}",
        f"CoE 0x${g.coe}%02x, FoE ${g.foe}, EoE ${g.eoe}, SoE channels ${g.soeChannels}, " +
          f"flags 0x${g.flags}%02x",
        s"EBUS current ${g.current} mA, " +
          s"ports ${(0 to 3).map(i => portName(g.ports >> 4 * i & 0xf)).mkString(" ")}"
      )
    case SiiFmmus(uses) =>
      uses.zipWithIndex.map { case (u, i) =>
        s"FMMU $i: ${FmmuUse.all.find(_.code == u).map(_.name).getOrElse(if (u == 0xff) "unused" else s"$u")}"
      }
    case SiiSyncManagers(managers) =>
      managers.zipWithIndex.map { case (s, i) =>
        val use = SmUse.all.find(_.code == s.kind).map(_.name).getOrElse(s"type ${s.kind}")
        f"SyncManager $i: $use, ${h16(s.start)}, ${s.size} ${if (s.size == 1) "byte" else "bytes"}, " +
          f"control 0x${s.control}%02x, enable 0x${s.enable}%02x"
      }
    case SiiPdos(tx, pdos) =>
      pdos.flatMap { p =>
        val on   = if (p.syncManager == 0xff) "not assigned" else s"SyncManager ${p.syncManager}"
        val name = s"${if (tx) "TxPDO" else "RxPDO"} ${h16(p.index)}${quoted(image.text(p.name))}"
        s"$name, $on, flags ${h16(p.flags)}" +:
          p.entries.map { e =>
            if (e.index == 0) s"  ${e.bits} bit padding"
            else {
              val kind =
                DataType.all.find(_.code == e.dataType).map(_.name).getOrElse(f"type 0x${e.dataType}%02x")
              f"  ${h16(e.index)}:${e.subIndex}%02x ${e.bits} bit $kind${quoted(image.text(e.name))}"
            }
          }
      }
    case SiiDcModes(modes) =>
      modes.map { m =>
        s"${image.text(m.name)}${quoted(image.text(m.description))}: " +
          s"AssignActivate ${h16(m.assignActivate)}, SYNC0 cycle ${m.cycleTime0} ns, " +
          s"factor ${m.cycleFactor0}, shift ${m.shiftTime0} ns, SYNC1 factor ${m.cycleFactor1}, " +
          s"shift ${m.shiftTime1} ns"
      }
    case _: SiiOther => Nil
  }

  private def portName(code: Int): String = code match {
    case 0     => "-"
    case 1     => "MII"
    case 3     => "EBUS"
    case 4     => "MII (fast hot connect)"
    case other => s"$other"
  }
}
