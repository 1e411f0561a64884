package flyframe.model

import scala.util.Random
import flyframe.params.EscParams
import flyframe.protocol.Command._
import flyframe.registers._

/** Random traffic for FMMUs, SyncManagers, AL and events: what a master and a host do with them, and what
  * neither should.
  *
  * @param model
  *   is asked how they are configured now
  */
class UnitTraffic(p: EscParams, model: EscModel, random: Random) {
  import UnitTraffic._

  private def chance(percent: Int): Boolean  = random.nextInt(100) < percent
  private def pick[T](items: Seq[T]): T      = items(random.nextInt(items.size))
  private def bytes(count: Int): Vector[Int] = Vector.fill(count)(random.nextInt(256))
  private def sm(n: Int, field: String)      = model.registers.value(s"sm${n}_$field")
  private def fmmu(n: Int, field: String)    = model.registers.value(s"fmmu${n}_$field")

  private val kinds: Seq[() => Seq[Datagram]] =
    (if (p.syncManagers > 0)
       Seq(() => Seq(configureManager()), () => onBuffer(), () => onBuffer(), () => onBuffer())
     else Nil) ++
      (if (p.fmmus > 0) Seq(() => Seq(configureFmmu()), () => Seq(logical()), () => Seq(logical()))
       else Nil) ++
      (if (p.hasApplicationLayer) Seq(() => Seq(application())) else Nil) ++
      (if (p.hasAlarm) Seq(() => Seq(alarm())) else Nil)

  /** There is something to play with. */
  val exists: Boolean = kinds.nonEmpty

  /** One or more datagrams that belong together. */
  def next(): Seq[Datagram] = pick(kinds)()

  /** What a datagram does: the commands for it by position, by station address, and for all. */
  private case class Access(byPosition: Int, byStation: Int, byAll: Int)
  private val reads  = Access(Aprd, Fprd, Brd)
  private val writes = Access(Apwr, Fpwr, Bwr)
  private val both   = Access(Aprw, Fprw, Brw)

  /** A datagram that finds this controller. */
  private def physical(access: Access, address: Int, data: Seq[Int]): Datagram = random.nextInt(4) match {
    case 0 => Datagram(access.byPosition, 0, address, data)
    case 1 => Datagram(access.byAll, random.nextInt(4), address, data)
    case _ => Datagram(access.byStation, model.registers.value("station_address"), address, data)
  }
  private def write(address: Int, data: Seq[Int]) = physical(if (chance(95)) writes else both, address, data)
  private def read(address: Int, count: Int)      = physical(reads, address, Vector.fill(count)(0))

  // ---- SyncManagers ----

  private def configureManager(): Datagram = {
    val n    = random.nextInt(p.syncManagers)
    val base = SyncManagerRegisters.of(n)
    if (sm(n, "enable") == 1)
      if (chance(20))
        write(base + SyncManagerRegisters.Activate, Seq(if (chance(80)) 0 else random.nextInt(4)))
      else read(base, 8)
    else if (chance(85)) {
      val slot   = (p.ramBytes / p.syncManagers) max 64
      val start  = RegisterMap.ProcessRamStart + n * slot + random.nextInt(4)
      val length = if (chance(75)) 1 + random.nextInt(10) else 1 + random.nextInt((slot / 3) min 200)
      val enable = if (chance(90)) 1 else random.nextInt(4)
      val mode   = pick(Seq(0, 2, 4, 6)) | random.nextInt(if (p.hasSequentialMode) 16 else 8) << 4
      val latch  = if (p.hasEventTimes) random.nextInt(4) << 6 else 0
      write(
        base,
        EtherCatFrame.little(start) ++ EtherCatFrame.little(length) ++ Seq(mode, 0, enable | latch, 0)
      )
    } else {
      val start = pick(
        Seq(
          random.nextInt(0x10000),
          RegisterMap.ProcessRamStart + p.ramBytes - random.nextInt(24),
          DigitalOutputRegisters.Outputs + random.nextInt(5),
          0xfff8
        )
      )
      val length = pick(Seq(0, 1, 2, 7, 0xffff, random.nextInt(0x10000), random.nextInt(64)))
      write(
        base,
        EtherCatFrame.little(start) ++ EtherCatFrame.little(length) ++ Seq(random.nextInt(256), 0, 1)
      )
    }
  }

  /** Accesses to one buffer, in one frame: complete, in parts, and beside it. */
  private def onBuffer(): Seq[Datagram] = {
    val n      = random.nextInt(p.syncManagers)
    val byEcat = (sm(n, "control") & 4) != 0
    Seq.fill(if (chance(60)) 1 else 1 + random.nextInt(4)) {
      val (start, count) = part(n)
      if (byEcat == chance(92)) write(start, bytes(count)) else read(start, count)
    }
  }

  /** Some bytes of a buffer: where, and how many. */
  private def part(n: Int): (Int, Int) = {
    val start  = sm(n, "start")
    val length = sm(n, "length") min 300
    val end    = start + sm(n, "length") - 1
    val split  = random.nextInt(length max 1)
    val (first, count) = random.nextInt(8) match {
      case 0 => (start, split)
      case 1 => (start + split, length - split)
      case 2 => (end, 1)
      case 3 => (start + split, 1)
      case 4 => (start - random.nextInt(3), length + random.nextInt(6))
      case _ => (start, length)
    }
    (first max 0 min 0xffff, count max 1)
  }

  // ---- FMMUs ----

  private def configureFmmu(): Datagram = {
    val n    = random.nextInt(p.fmmus)
    val base = FmmuRegisters.of(n)
    if (chance(10)) write(base + FmmuRegisters.Activate, Seq(random.nextInt(2)))
    else {
      val usual = chance(85)
      val start =
        if (usual) LogicalBase + n * 12L + random.nextInt(6)
        else pick(Seq(0xfffffff8L, 0xffffffffL, 0L, random.nextInt() & 0xffffffffL))
      val length = if (usual) 1 + random.nextInt(10) else pick(Seq(0, 1, 0x7fff, 0xffff))
      val bits   = if (chance(60)) Seq(0, 7) else Seq(random.nextInt(8), random.nextInt(8))
      val bit    = if (bits == Seq(0, 7) && chance(90)) 0 else random.nextInt(8)
      val physical =
        if (p.syncManagers > 0 && chance(60)) sm(random.nextInt(p.syncManagers), "start")
        else
          pick(
            Seq(
              RegisterMap.ProcessRamStart + random.nextInt(p.ramBytes max 1),
              RegisterMap.ProcessRamStart + p.ramBytes - 1 - random.nextInt(12),
              RegisterMap.UserRamStart + random.nextInt(128),
              DigitalOutputRegisters.Outputs + random.nextInt(5),
              random.nextInt(0x14),
              FmmuRegisters.First + random.nextInt(0x300),
              0xfffc + random.nextInt(4)
            )
          )
      write(
        base,
        (0 until 4).map(i => (start >> 8 * i & 0xff).toInt) ++ EtherCatFrame.little(length) ++ bits ++
          EtherCatFrame.little(physical) ++ Seq(bit, 1 + random.nextInt(3), if (chance(92)) 1 else 0)
      )
    }
  }

  private def logical(): Datagram = {
    val n     = random.nextInt(p.fmmus)
    val start = model.registers.wide(s"fmmu${n}_logical_start")
    val first = start + (if (chance(60)) 0 else random.nextInt(6) - 3)
    val count = if (chance(60)) fmmu(n, "length") min 40 max 1 else 1 + random.nextInt(16)
    Datagram(pick(Seq(Lrd, Lwr, Lrw)), first & 0xffffffffL, bytes(count))
  }

  // ---- application layer and events ----

  private def application(): Datagram = random.nextInt(6) match {
    case 0 => write(ApplicationRegisters.Control, Seq(pick(Seq(1, 2, 3, 4, 8, 0x11, random.nextInt(256)))))
    case 1 => write(ApplicationRegisters.Control + random.nextInt(2), bytes(1 + random.nextInt(2)))
    case 2 => read(ApplicationRegisters.Status + random.nextInt(2), 1 + random.nextInt(6))
    case 3 => read(DlRegisters.Status + random.nextInt(2), 1)
    case 4 => write(EventRegisters.EcatMask, bytes(1 + random.nextInt(2)))
    case _ => read(pick(Events), 4)
  }

  // ---- smoke detector ----

  private def alarm(): Datagram = random.nextInt(12) match {
    case 0 => write(AlarmRegisters.Acknowledge + random.nextInt(6), bytes(1 + random.nextInt(3)))
    case 1 =>
      write(AlarmRegisters.Command, Seq(if (chance(3)) 2 else if (chance(20)) random.nextInt(4) else 1))
    case 2 | 3 =>
      write(
        pick(Seq(AlarmRegisters.Broadcast, AlarmRegisters.Message)) + random.nextInt(8),
        bytes(1 + random.nextInt(8))
      )
    case 4 | 5 | 6 =>
      read(
        pick(Seq(AlarmRegisters.State, AlarmRegisters.Confirm, AlarmRegisters.SelfTest)) + random.nextInt(3),
        1 + random.nextInt(8)
      )
    case 7 => write(AlarmRegisters.Mode, Seq(pick(Seq(0, 0, 0, 1, 2, random.nextInt(256)))))
    case 8 => write(AlarmRegisters.Acknowledge, bytes(6)) // of nothing that there is
    case _ => confirm()
  }

  /** What the server has: up to about one of the records that the master has got; rarely of another life. */
  private def confirm(): Datagram = {
    val life   = model.alarm.get.masterLife
    val tags   = model.alarm.get.tags
    val tag    = if (tags.isEmpty) random.nextInt(0x10000) else pick(tags)
    val number = tag + pick(Seq(0, 1, 2, 0x7fff, 0x8000))
    write(
      AlarmRegisters.Confirm,
      EtherCatFrame.little(number & 0xffff) ++
        EtherCatFrame.little(if (chance(95)) life else (life + 1) & 0xffff)
    )
  }

  private def hostOnAlarm(writer: VectorWriter): Unit = random.nextInt(8) match {
    case 0     => acknowledge(AlarmRegisters.Messages, writer)
    case 1 | 2 => writer.hostRead(AlarmRegisters.State + random.nextInt(8))
    case 3     => writer.hostWrite(AlarmRegisters.Epoch, random.nextInt(256))
    case 4     => writer.hostWrite(AlarmRegisters.Command, 1)
    case 5     => writer.hostWrite(AlarmRegisters.Mode, pick(Seq(0, 0, 0, 1, 2)))
    case 6     => writer.hostWrite(AlarmRegisters.SelfTest, random.nextInt(3))
    case _     => writer.hostWrite(AlarmRegisters.Enable, if (chance(70)) 3 else random.nextInt(256))
  }

  // ---- host ----

  /** Reads a register whose events that ends, or writes it, if that does. */
  private def acknowledge(address: Int, writer: VectorWriter): Unit =
    if (p.acknowledgesByWrite && chance(60)) writer.hostWrite(address, random.nextInt(256))
    else writer.hostRead(address)

  /** Something the host does between two frames. */
  def host(writer: VectorWriter): Unit =
    if (p.hasAlarm && chance(50)) hostOnAlarm(writer) else ordinary(writer)

  private def ordinary(writer: VectorWriter): Unit = random.nextInt(10) match {
    case 0 => acknowledge(ApplicationRegisters.Control + random.nextInt(2), writer)
    case 1 =>
      writer.hostWrite(
        ApplicationRegisters.Status + random.nextInt(2),
        pick(Seq(1, 2, 4, 8, 0x12, random.nextInt(256)))
      )
    case 2 => writer.hostWrite(EventRegisters.AlMask + random.nextInt(4), random.nextInt(256))
    case 3 => writer.hostReadWord(pick(Words))
    case _ => if (p.syncManagers > 0) hostOnManager(random.nextInt(p.syncManagers), writer)
  }

  private def hostOnManager(n: Int, writer: VectorWriter): Unit = {
    val deactivated =
      (model.registers.byte(SyncManagerRegisters.of(n) + SyncManagerRegisters.PdiControl) & 1) == 1
    random.nextInt(10) match {
      case 0 => acknowledge(SyncManagerRegisters.of(n) + SyncManagerRegisters.Activate, writer)
      case 1 => writer.hostRead(SyncManagerRegisters.of(n) + SyncManagerRegisters.Status)
      case r if deactivated && r < 5 =>
        writer.hostWrite(SyncManagerRegisters.of(n) + SyncManagerRegisters.PdiControl, 0)
      case 2 if sm(n, "enable") == 1 && chance(70) =>
        val delay = if (p.hasDeactivationDelay && chance(60)) 0x40 else 0
        writer.hostWrite(
          SyncManagerRegisters.of(n) + SyncManagerRegisters.PdiControl,
          delay | (if (delay > 0 && chance(80)) 0 else random.nextInt(4))
        )
      case _ =>
        val byHost         = (sm(n, "control") & 4) == 0
        val (start, count) = part(n)
        val range          = (start until start + (count min 32)).filter(_ <= 0xffff)
        val whole          = if (count <= 32) range else range :+ (start + count - 1 min 0xffff)
        val writes         = byHost == chance(92)
        whole.foreach { a =>
          if (writes) writer.hostWrite(a, calm(p, a, random.nextInt(256))) else writer.hostRead(a)
        }
        // Where that closes what has been read.
        if (p.acknowledgesByWrite && !byHost && chance(70))
          for (a <- whole.lastOption) writer.hostWrite(a, calm(p, a, random.nextInt(256)))
    }
  }
}

object UnitTraffic {
  private val LogicalBase = 0x00010000L

  /** Not read in random traffic. */
  val WatchdogStates: Range = WatchdogRegisters.StatusProcessData to WatchdogRegisters.StatusPdi

  private val Events =
    Seq(
      ApplicationRegisters.Control,
      EventRegisters.AlMask,
      EventRegisters.EcatRequest,
      EventRegisters.AlRequest
    )

  /** What a host reads as a whole word. */
  private val Words = Seq(
    ApplicationRegisters.Control,
    EventRegisters.EcatRequest,
    EventRegisters.AlRequest,
    SyncManagerRegisters.First + SyncManagerRegisters.Control,
    RegisterMap.ProcessRamStart,
    RegisterMap.ProcessRamStart + 4
  )

  /** FMMU-08: FMMUs that map bits, those with an odd number, keep their distance from all others. */
  private def apart(address: Int): Option[Int => Int] = {
    val n   = (address - FmmuRegisters.First) / FmmuRegisters.Stride
    val odd = n % 2 == 1
    address % 16 match {
      case 0 if odd => Some(_ & 0x3f)
      case 1 if odd => Some(_ => n)
      case 2 if odd => Some(_ => 0x11)
      case 3 if odd => Some(_ => 0x55)
      case 4 if odd => Some(_ & 0x3f | 2)
      case 5 if odd => Some(_ => 0)
      case 3        => Some(b => if (b == 0x55) 0x54 else b)
      case 6 | 10   => Some(b => if (odd) b else 0)
      case 7        => Some(b => if (odd) b else 7)
      case _        => None
    }
  }

  /** The physical start of an FMMU. */
  private val PhysicalLow  = 8
  private val PhysicalHigh = 9

  /** From the second half of this page of 256 bytes on, an FMMU may reach a register that makes a unit count
    * time.
    */
  private def reaches(page: Int): Boolean =
    page == (DlRegisters.Control >> 8) - 1 || page == AlarmRegisters.Debounce >> 8

  /** No debounce, no off time, and the host is never taken for alive. */
  private val timesOfDetector =
    (AlarmRegisters.Debounce to AlarmRegisters.OffTime + 1) ++
      (AlarmRegisters.HostAlive to AlarmRegisters.HostAlive + 1)

  /** A mode of the detector lasts longer than any random traffic. */
  val secondsOfMode: Range = AlarmRegisters.Mode + 2 to AlarmRegisters.Mode + 3

  /** What may be written to `address` in random traffic in place of `byte`, so that no unit starts to count
    * time: no temporary loops, no watchdogs, no EEPROM commands, no debounce; and no FMMU that reaches those
    * registers.
    */
  def calm(p: EscParams, address: Int, byte: Int): Int = {
    val inFmmus = address >= FmmuRegisters.First && address < FmmuRegisters.of(p.fmmus)
    address match {
      case DlRegisters.Control => byte & 0xfd
      // Rarely a small RX FIFO, as clocks must be nearly right with it (LP-12, VectorWriter).
      case DlRegisters.FifoByte                                                          => byte | 4
      case a if p.hasWatchdogs && WatchdogRegisters.settings.contains(a)                 => 0
      case a if p.hasSii && (a == SiiRegisters.Control || a == SiiRegisters.Control + 1) => 0
      case a if p.hasAlarm && timesOfDetector.contains(a)                                => 0
      case a if p.hasAlarm && secondsOfMode.contains(a)                                  => 0xff
      case a if inFmmus && p.hasBitwiseFmmus && apart(a).isDefined                       => apart(a).get(byte)
      case a if inFmmus && a % 16 == PhysicalLow                            => byte & 0x7f
      case a if inFmmus && a % 16 == PhysicalHigh && byte >= 1 && byte <= 5 => byte | 0x10
      case _ => byte
    }
  }

  /** The same for a whole datagram. */
  def calm(p: EscParams, d: Datagram): Datagram =
    if (Set(Lrd, Lwr, Lrw)(d.command)) d
    else {
      val address = (d.address >> 16 & 0xffff).toInt
      if (
        p.hasWatchdogs && address <= WatchdogStates.end && address + d.data.size > WatchdogStates.start &&
        d.command != Apwr
      )
        d.copy(address = d.address ^ (0x0800L << 16)) // no reading of watchdog states
      else
        d.copy(data = d.data.zipWithIndex.map { case (b, i) =>
          val calmed  = calm(p, address + i, b)
          val inFmmus = address + i >= FmmuRegisters.First && address + i < FmmuRegisters.of(p.fmmus)
          (address + i) % 16 match {
            // An FMMU may begin anywhere in a page from which it reaches nothing that counts time.
            case PhysicalLow
                if inFmmus && d.data.lift(i + 1).map(calm(p, address + i + 1, _)).exists(!reaches(_)) =>
              b
            case PhysicalHigh if inFmmus && i == 0 && reaches(calmed) =>
              calmed | 0x10 // it may begin late in the page
            case _ => calmed
          }
        })
    }

  /** With one access to what works on the records of a detector, as masters do: two of them in a frame meet
    * an order of times.
    */
  def oneForEvents(datagrams: Seq[Datagram]): Seq[Datagram] = {
    def touches(d: Datagram) = {
      val address = (d.address >> 16 & 0xffff).toInt
      Seq(AlarmRegisters.Acknowledge, AlarmRegisters.Confirm, AlarmRegisters.Command, AlarmRegisters.Mode)
        .flatMap(at => AlarmRegisters.all.find(_.address == at))
        .exists(r => address <= r.range.last && address + d.data.size > r.address)
    }
    val first = datagrams.indexWhere(touches)
    datagrams.zipWithIndex.map { case (d, i) =>
      if (i > first && touches(d)) d.copy(address = d.address ^ (0x0800L << 16)) else d
    }
  }
}
