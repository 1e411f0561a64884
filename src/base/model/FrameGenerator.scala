package flyframe.model

import scala.util.Random
import flyframe.params.EscParams
import flyframe.protocol.Command._
import flyframe.protocol.DatagramLayout
import flyframe.registers.{DlRegisters, ProtectionRegisters, RegisterMap}

/** Random frames for one controller: valid ones that reach deep, and everything a broken sender, cable or
  * attacker may produce.
  *
  * @param model
  *   is asked for the present station address, so that frames find it
  */
class FrameGenerator(p: EscParams, model: EscModel, random: Random) {
  private def chance(percent: Int): Boolean  = random.nextInt(100) < percent
  private def pick[T](items: Seq[T]): T      = items(random.nextInt(items.size))
  private def bytes(count: Int): Vector[Int] = Vector.fill(count)(random.nextInt(256))
  private val registerStarts                 = RegisterMap(p).map(_.address)
  private val existing                       = RegisterMap(p).flatMap(_.range)
  private val units                          = new UnitTraffic(p, model, random)

  /** Content that is changed at random must not get a new meaning everywhere: some units count time. */
  private val timeless = !p.hasWatchdogs && !p.hasSii

  private def commandCode(): Int =
    if (chance(92)) random.nextInt(15) else pick(Seq(15, 16, 0x11, 0x17, 0x87, 255))

  private def adp(): Int = random.nextInt(10) match {
    case 0 | 1 | 2 => 0
    case 3 | 4 | 5 => model.registers.value("station_address")
    case 6         => model.registers.value("station_alias")
    case 7         => pick(Seq(0xffff, 1, 0x1001, 0x00ff, 0x0fff))
    case 8         => model.registers.value("station_address") | 1 << random.nextInt(16)
    case _         => random.nextInt(0x10000)
  }

  private def ado(): Int = random.nextInt(12) match {
    case 0 | 1 | 2 => pick(registerStarts)
    case 3         => (pick(existing) + random.nextInt(5) - 2) max 0
    case 4 | 5     => RegisterMap.UserRamStart + random.nextInt(128)
    case 6         => RegisterMap.UserRamStart - 4 + random.nextInt(8)
    case 7 | 8     => RegisterMap.ProcessRamStart + random.nextInt((p.ramBytes + 8) max 16)
    case 9         => RegisterMap.ProcessRamStart + p.ramBytes - 8 + random.nextInt(12)
    case 10        => 0x10000 - 1 - random.nextInt(12)
    case _         => random.nextInt(0x10000)
  }

  private def length(): Int = random.nextInt(20) match {
    case 0         => 0
    case 1         => random.nextInt(300)
    case 2         => 20 + random.nextInt(40)
    case 3 | 4 | 5 => 1
    case _         => 1 + random.nextInt(12)
  }

  private def datagram(): Datagram = {
    val address = ado()
    val code    = commandCode()
    val count   = length()
    val writes  = Set(Apwr, Aprw, Fpwr, Fprw, Bwr, Brw, Armw, Frmw)(code)
    val data = (if (writes || chance(30)) bytes(count) else Vector.fill(count)(0)).zipWithIndex.map {
      case (b, i) =>
        address + i match {
          case DlRegisters.Control =>
            if (chance(80)) (b | 1) & 0xfd else b & 0xfd // no temporary use: wall clock
          case DlRegisters.LoopByte if chance(85) => 0 // mostly keep the loops as they are
          case _                                  => b
        }
    }
    Datagram(
      code,
      (adp() & 0xffff) | (address & 0xffff).toLong << 16,
      data,
      index = random.nextInt(256),
      circulating = chance(3),
      irq = if (chance(20)) random.nextInt(0x10000) else 0,
      workingCounter = if (chance(80)) random.nextInt(4) else pick(Seq(0xffff, 0xfffe, 0x00ff, 0x0fff)),
      reserved = if (chance(5)) random.nextInt(8) else 0
    )
  }

  /** Else, as random writes protect all sooner or later, nothing would be written any more. */
  private val enables = Seq(ProtectionRegisters.RegisterEnable, ProtectionRegisters.EscEnable).map(a =>
    Datagram(Bwr, a.toLong << 16, Seq(1))
  )

  private def datagrams(): Seq[Datagram] = {
    val count =
      if (chance(60)) 1 + random.nextInt(3)
      else if (chance(90)) 1 + random.nextInt(12)
      else 1 + random.nextInt(140)
    val all =
      if (units.exists && count <= 20)
        Seq.fill(count)(if (chance(65)) units.next() else Seq(datagram())).flatten.map(UnitTraffic.calm(p, _))
      else Seq.fill(count)(if (count > 20) datagram().copy(data = Nil) else datagram())
    val free  = if (p.hasWriteProtection && chance(70)) enables ++ all else all
    val apart = if (p.hasAlarm) UnitTraffic.oneForEvents(free) else free
    apart.zip(apart.scanLeft(0)((s, d) => s + d.data.size + DatagramLayout.Overhead)).collect {
      case (d, before) if before + d.data.size < 1480 => d
    }
  }

  /** An EtherCAT frame without FCS, in order but for what `headerType` and padding say. */
  private def ethercat(): Seq[Int] = {
    val form    = if (chance(70)) Encapsulation.Basic else pick(Encapsulation.all)
    val isEmpty = p.hasAlarm && chance(20) // something can be appended to it
    val list    = if (isEmpty) Nil else datagrams()
    val frame = EtherCatFrame(
      if (list.isEmpty && !isEmpty) Seq(datagram().copy(data = Nil)) else list,
      form,
      if (chance(95)) 1 else random.nextInt(16)
    )
    val padding = if (chance(90)) 0 else random.nextInt(75)
    frame ++ (if (chance(50)) bytes(padding) else Vector.fill(padding)(0))
  }

  private def foreign(): Seq[Int] = {
    val start = bytes(12)
    val body = random.nextInt(6) match {
      case 0 => Seq(0x08, 0x06) ++ bytes(46)
      case 1 => Seq(0x08, 0x00, 0x45, 0) ++ bytes(7) ++ Seq(0x11) ++ bytes(60)
      case 2 => Seq(0x08, 0x00, 0x45, 0) ++ bytes(7) ++ Seq(0x06) ++ bytes(60)
      case 3 => Seq(0x81, 0x00, 0, 5, 0x81, 0x00, 0, 6, 0x88, 0xa4) ++ bytes(50)
      case 4 => Seq(0x88, 0xa4) ++ bytes(60)
      case _ => bytes(2) ++ bytes(46 + random.nextInt(100))
    }
    start ++ body
  }

  private def symbolsOf(bytes: Seq[Int], preamble: Int): Vector[Symbol] =
    WireFrame.ofBytes(bytes, preamble).symbols

  private def preamble(): Int = if (chance(95)) 15 else random.nextInt(20)

  private def insert[T](items: Vector[T], position: Int, item: T): Vector[T] =
    items.take(position) ++ (item +: items.drop(position))

  /** The next frame. */
  def next(): WireFrame = {
    val content  = if (chance(94)) ethercat() else foreign()
    val whole    = content ++ Fcs.of(content)
    val symbols  = symbolsOf(whole, preamble())
    def anywhere = random.nextInt(symbols.size)
    val damaged = random.nextInt(100) match {
      case r if r < 64 => symbols
      case r if r < 68 =>
        symbolsOf(
          content.updated(random.nextInt(content.size), random.nextInt(256)),
          15
        ) // FCS not even there
      case r if r < 72 => // changed content, FCS made right again: reaches the parser's corners
        val places  = if (timeless) content.size - 12 else 6
        val changed = content.updated(12 + random.nextInt(places), random.nextInt(256))
        symbolsOf(changed ++ Fcs.of(changed), 15)
      case r if r < 76 =>
        val i = anywhere; symbols.updated(i, Symbol(symbols(i).nibble ^ (1 << random.nextInt(4))))
      case r if r < 79 => symbols.take(1 + anywhere)
      case r if r < 82 => // cut, with a right FCS
        val cut = content.take(1 + random.nextInt(content.size))
        symbolsOf(cut ++ Fcs.of(cut), 15)
      case r if r < 85 => symbols :+ Symbol(random.nextInt(16)) // dribble
      case r if r < 88 => // marked by an ESC before
        val i = symbols.size - 1 - random.nextInt(8)
        symbols.updated(i, Symbol(symbols(i).nibble ^ 0xf)) :+ Symbol(0)
      case r if r < 91 => val i = anywhere; symbols.updated(i, symbols(i).copy(error = true))
      case r if r < 93 => insert(symbols, anywhere, Symbol(random.nextInt(16)))
      case r if r < 94 => symbols.map(s => if (chance(10)) s.copy(error = true) else s)
      case r if r < 95 => Vector.fill(1 + random.nextInt(30))(Symbol(random.nextInt(16)))
      case r if r < 96 => Vector.fill(1 + random.nextInt(30))(Symbol(5))
      case r if r < 97 => symbolsOf(content.take(60 + random.nextInt(10)) ++ bytes(random.nextInt(8)), 15)
      case r if r < 98 =>
        val i = random.nextInt(17) min (symbols.size - 1); symbols.updated(i, Symbol(random.nextInt(16)))
      case 98 => symbolsOf(content ++ bytes(80), 15)
      case _  => overlong(content)
    }
    WireFrame(damaged)
  }

  private def overlong(content: Seq[Int]): Vector[Symbol] =
    if (chance(90)) symbolsOf(content ++ Fcs.of(content), 15)
    else {
      val long = content ++ bytes(2044 - content.size + random.nextInt(6) - 3)
      symbolsOf(long ++ Fcs.of(long), 15) ++ (if (chance(30)) Vector(Symbol(0)) else Vector.empty)
    }
}
