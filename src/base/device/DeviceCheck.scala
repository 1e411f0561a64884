package flyframe.device

import flyframe.params.EscParams
import flyframe.registers.DigitalOutputRegisters

/** Whether a controller can be a device. */
object DeviceCheck {
  private val RamStart      = 0x1000
  private val MailboxBytes  = 16 to 1486 // header and the shortest CoE message; data of one datagram
  private val CoeBytes      = 32         // an SDO entry description with some of its name
  private val ReservedA5    = 0xf0b1
  private val ReservedA6    = 0xfffd     // bit 0, area B, is not written by us
  private val EepromMinimum = 256

  private def hex(v: Int): String   = f"0x$v%04x"
  private def bytes(n: Int): String = if (n == 1) "1 byte" else s"$n bytes"

  /** It is that of a byte of the digital outputs (SM-26). */
  private def isDigital(sm: SyncManager, p: EscParams): Boolean =
    sm.size == 1 && sm.start - DigitalOutputRegisters.Outputs >= 0 &&
      sm.start - DigitalOutputRegisters.Outputs < p.digitalOutputs

  /** Memory that SyncManager `sm` occupies, first and last address (SM-10, SM-17). With a data bus wider than
    * 8 bit each buffer is rounded out to whole 32-bit words (SM-11). A byte of the digital outputs is no
    * buffer (SM-24).
    */
  private def occupied(sm: SyncManager, p: EscParams): (Int, Int) = if (isDigital(sm, p)) (sm.start, sm.start)
  else {
    val word  = if (p.dataBusWidth == 8) 1 else 4
    val first = sm.start / word * word
    val next  = (sm.start + sm.size + word - 1) / word * word
    (first, first + sm.use.buffers * (next - first) - 1)
  }

  /** Why a controller with parameters `p`, `fmmus` FMMUs (0 to 16) and `syncManagers` SyncManagers (0 to 16)
    * cannot be the device `d`: one sentence per problem. Empty = it can.
    */
  def problems(d: Device, p: EscParams, fmmus: Int, syncManagers: Int): Seq[String] =
    counts(d, fmmus, syncManagers) ++ configuration(d, p) ++ memory(d, p) ++ mailbox(d, p) ++ processData(
      d
    ) ++
      objects(d) ++ clocks(d, p) ++ eeprom(d, p)

  /** `d` if a controller can be it, else the first problem. */
  def check(d: Device, p: EscParams, fmmus: Int, syncManagers: Int): Either[String, Device] =
    problems(d, p, fmmus, syncManagers).headOption.toLeft(d)

  private def counts(d: Device, fmmus: Int, syncManagers: Int) = Seq(
    Option.when(d.syncManagers.size > syncManagers)(
      s"The device has ${d.syncManagers.size} SyncManagers but the controller has $syncManagers."
    ),
    Option.when(d.fmmus.size > fmmus)(
      s"The device uses ${d.fmmus.size} FMMUs but the controller has $fmmus."
    )
  ).flatten

  private def configuration(d: Device, p: EscParams) = {
    val c = d.configuration
    Seq(
      Option.when((c.escA5 & ReservedA5) != 0)(
        s"configuration.escA5 is ${hex(c.escA5)} but the reserved bits ${hex(ReservedA5)} must be 0."
      ),
      Option.when((c.escA6 & ReservedA6) != 0)(
        s"configuration.escA6 is ${hex(c.escA6)} but may only have bit 1 set."
      ),
      Option.when(c.stationAlias >= (1 << p.nodeIdWidth))(
        s"configuration.stationAlias is ${hex(c.stationAlias)} but the controller has an alias of " +
          s"${p.nodeIdWidth} bits."
      )
    ).flatten
  }

  private def memory(d: Device, p: EscParams) = {
    val end  = RamStart + p.ramBytes
    val used = d.syncManagers.zipWithIndex.filter { case (sm, _) => sm.use != SmUse.Unused && sm.size > 0 }
    val outside = used.flatMap { case (sm, i) =>
      val (first, last) = occupied(sm, p)
      Option.when(!isDigital(sm, p) && (first < RamStart || last >= end))(
        s"SyncManager $i occupies ${hex(first)} to ${hex(last)}${if (sm.use.process) ", three buffers,"
          else ""} but the " +
          (if (p.ramBytes == 0) "controller has no process data RAM."
           else s"process data RAM is ${hex(RamStart)} to ${hex(end - 1)}.")
      )
    }
    val overlapping = used.combinations(2).flatMap { pair =>
      val Seq((a, i), (b, j)) = pair
      val (a0, a1)            = occupied(a, p)
      val (b0, b1)            = occupied(b, p)
      Option.when(a0 <= b1 && b0 <= a1)(
        s"SyncManagers $i (${hex(a0)} to ${hex(a1)}) and $j (${hex(b0)} to ${hex(b1)}) overlap."
      )
    }
    val control = d.syncManagers.zipWithIndex.flatMap { case (sm, i) =>
      Option.when((sm.control & 0x0f) != sm.use.control)(
        f"SyncManager $i has control 0x${sm.control}%02x but its use, ${sm.use.name}, needs the low digit " +
          f"0x${sm.use.control}%x."
      )
    }
    control ++ outside ++ overlapping
  }

  private def mailbox(d: Device, p: EscParams) = {
    val managers = d.syncManagers.zipWithIndex.filter(_._1.use.mailbox)
    val places = Seq(SmUse.MailboxOut, SmUse.MailboxIn).zipWithIndex.flatMap { case (use, number) =>
      val found = managers.filter(_._1.use == use).map(_._2)
      Option.when(d.mailbox.nonEmpty && found != Seq(number))(
        s"A mailbox needs SyncManager $number, and no other, used for ${use.name}: masters expect it there."
      )
    }
    val unwanted = Option.when(d.mailbox.isEmpty && managers.nonEmpty)(
      s"SyncManager ${managers.head._2} is used for ${managers.head._1.use.name} " +
        "but the device has no mailbox."
    )
    val boot =
      d.mailbox.flatMap(_.bootstrap).toSeq.flatMap(b => Seq("receive" -> b.receive, "send" -> b.send))
    val sizes = (managers.map { case (sm, i) => s"SyncManager $i" -> sm.size } ++
      boot.map { case (n, a) => s"mailbox.bootstrap.$n" -> a.size }).flatMap { case (name, size) =>
      Option.when(!MailboxBytes.contains(size))(
        s"$name has ${bytes(size)} but a mailbox has ${MailboxBytes.head} to ${MailboxBytes.last}."
      )
    }
    val bootOutside = boot.flatMap { case (n, a) =>
      Option.when(a.start < RamStart || a.start + a.size > RamStart + p.ramBytes)(
        s"mailbox.bootstrap.$n occupies ${hex(a.start)} to ${hex(a.start + a.size - 1)}, " +
          "beyond the process data RAM."
      )
    }
    val bootOverlap = d.mailbox.flatMap(_.bootstrap).flatMap { b =>
      Option.when(
        b.receive.start < b.send.start + b.send.size && b.send.start < b.receive.start + b.receive.size
      )(
        "mailbox.bootstrap.receive and mailbox.bootstrap.send overlap."
      )
    }
    val coe = d.mailbox.filter(m => m.coe.nonEmpty && !m.protocols(MailboxProtocol.CoE)).map { _ =>
      "mailbox.coe is given but mailbox.protocols lacks CoE."
    }
    places ++ unwanted ++ sizes ++ bootOutside ++ bootOverlap ++ coe
  }

  private def processData(d: Device) = {
    val directions = Seq(
      ("RxPDO", d.rxPdos, SmUse.Outputs, FmmuUse.Outputs, 0x1600 to 0x17ff),
      ("TxPDO", d.txPdos, SmUse.Inputs, FmmuUse.Inputs, 0x1a00 to 0x1bff)
    )
    def repeated[A](items: Seq[A]): Option[A] = items.diff(items.distinct).headOption
    val single = directions.flatMap { case (kind, pdos, use, fmmu, range) =>
      pdos.flatMap { pdo =>
        val name = s"$kind ${hex(pdo.index)}"
        Seq(
          Option.when(!range.contains(pdo.index))(
            s"$name must have an index of ${hex(range.head)} to ${hex(range.last)}."
          ),
          d.syncManagers.lift(pdo.syncManager) match {
            case None => Some(s"$name is on SyncManager ${pdo.syncManager}, which the device does not have.")
            case Some(sm) if sm.use != use =>
              Some(
                s"$name is on SyncManager ${pdo.syncManager}, which is used for ${sm.use.name}, " +
                  s"not for ${use.name}."
              )
            case _ => None
          },
          Option.when(pdo.entries.isEmpty)(s"$name has no entries."),
          Option.when(pdo.entries.size > 255)(
            s"$name has ${pdo.entries.size} entries but must have 1 to 255."
          )
        ).flatten
      } ++ repeated(pdos.map(_.index)).map(i => s"$kind ${hex(i)} exists twice.") ++
        Option.when(pdos.nonEmpty && !d.fmmus.contains(fmmu))(
          s"The device has ${kind}s but no FMMU used for ${fmmu.name}."
        )
    }
    val mapped = for {
      pdo   <- d.pdos
      entry <- pdo.entries if entry.dataType.nonEmpty
    } yield (entry.index, entry.subIndex)
    val twice = repeated(mapped).map { case (i, s) => f"The entry 0x$i%04x:$s%02x is mapped twice." }
    val sizes = d.syncManagers.zipWithIndex.filter(_._1.use.process).flatMap { case (sm, i) =>
      val pdos   = d.pdos.filter(_.syncManager == i)
      val bits   = pdos.map(_.bits).sum
      val needed = (bits + 7) / 8
      if (pdos.isEmpty) Some(s"SyncManager $i is used for ${sm.use.name} but carries no PDO.")
      else
        Option.when(sm.size != needed)(
          s"SyncManager $i has ${bytes(sm.size)} but its PDOs have $bits bits and need ${bytes(needed)}."
        )
    }
    single ++ twice ++ sizes
  }

  /** What the dictionary of the slave stack needs. */
  private def objects(d: Device) = {
    val coe     = d.mailbox.exists(_.protocols(MailboxProtocol.CoE))
    val indexes = Dictionary.of(d).map(_.index)
    val unwanted =
      Option.when(!coe && d.objects.nonEmpty)("The device has objects but mailbox.protocols lacks CoE.")
    val twice = indexes.diff(indexes.distinct).headOption.map(i => s"The object ${hex(i)} exists twice.")
    val entries = d.objects.flatMap { o =>
      val subs = o.entries.map(_.subIndex)
      Option.when(subs != subs.distinct.sorted)(s"The object ${hex(o.index)} has its entries out of order.")
    }
    val mixed = d.pdos.flatMap(_.entries).filter(_.dataType.nonEmpty).groupBy(_.index).collectFirst {
      case (i, es) if es.exists(_.subIndex == 0) && es.size > 1 =>
        s"The object ${hex(i)} has subindex 0 and others in PDOs."
    }
    val torn = d.objects.collectFirst {
      case o
          if o.entries.exists(e =>
            e.dataType.isText && o.entries.takeWhile(_ != e).map(_.dataType.bits).sum % 8 != 0
          ) =>
        s"The object ${hex(o.index)} has a text behind bits that are no whole byte."
    }
    val small = d.syncManagers.zipWithIndex.collectFirst {
      case (sm, i) if sm.use.mailbox && sm.size < CoeBytes =>
        s"SyncManager $i has ${bytes(sm.size)} but a mailbox with CoE has at least $CoeBytes."
    }
    unwanted ++ (if (coe) twice ++ entries ++ mixed ++ torn ++ small else Nil)
  }

  private def clocks(d: Device, p: EscParams) =
    if (d.dcModes.isEmpty) None
    else if ((p.features & 0x04) == 0)
      Some("The device has dcModes but the controller has no distributed clocks.")
    else
      Option.when(p.hasTimeByPdi)(
        "The device has dcModes but timeByPdi is 1: no master can bring its time to that of others."
      )

  private def eeprom(d: Device, p: EscParams) = {
    val size = d.eepromBytes
    if (size % 128 != 0 || size < EepromMinimum)
      Some(s"eepromBytes is $size but must be a multiple of 128 from $EepromMinimum to ${1 << 19}.")
    else if (DeviceSii.strings(d).size > 255)
      Some(s"The device has ${DeviceSii.strings(d).size} different names but the SII holds 255.")
    else {
      val needed = SiiCodec.used(DeviceSii.image(d, p.ports))
      Option.when(needed > size)(s"The SII needs ${bytes(needed)} but the EEPROM has $size (eepromBytes).")
    }
  }
}
