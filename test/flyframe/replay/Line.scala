package flyframe.replay

import scala.collection.mutable
import flyframe.device.SiiCodec
import flyframe.rules.Reply

/** A datagram of a recording as it came back, and the positions of the slaves it addressed; of ARMW and FRMW
  * that is the one that is read.
  */
final case class Addressed(frame: Int, number: Int, reply: Reply, slaves: Set[Int]) {
  def reads: Boolean  = Set(1, 3, 4, 6, 7, 9, 13, 14).contains(reply.command)
  def writes: Boolean = Set(2, 3, 5, 6, 8, 9).contains(reply.command)

  /** It touches a byte of `area`. */
  def touches(area: Range): Boolean =
    slaves.nonEmpty && reply.ado <= area.last && reply.ado + reply.length > area.head

  /** The recorded byte at an address of the slave, if the datagram holds it. */
  def byte(address: Int): Option[Int] = reply.data.lift(address - reply.ado)
}

/** What a recording tells of the `size` slaves of a line. `answers`: the answer to each frame, if there was
  * one.
  */
final class Line(size: Int, answers: Seq[Option[RecordedFrame]]) {
  private val stations = mutable.Map.empty[Int, Int]

  /** All datagrams, in order. */
  val datagrams: Seq[Addressed] = for {
    (answer, frame) <- answers.zipWithIndex
    frameBack       <- answer.toSeq
    (reply, number) <- frameBack.datagrams.zipWithIndex
  } yield {
    // Every slave has added 1 to the position address of the answer.
    val slaves: Set[Int] = reply.command match {
      case 1 | 2 | 3 | 13 => Set((size - reply.adp) & 0xffff).filter(_ < size)
      case 4 | 5 | 6 | 14 => stations.get(reply.adp).toSet
      case 7 | 8 | 9      => (0 until size).toSet
      case _              => Set.empty
    }
    val addressed = Addressed(frame, number, reply, slaves)
    if (addressed.writes && reply.ado == 0x0010 && reply.length >= 2 && reply.workingCounter > 0) {
      stations.filterInPlace((_, position) => !slaves(position))
      val station = reply.data.head | reply.data(1) << 8
      if (slaves.size == 1) stations(station) = slaves.head
    }
    addressed
  }

  /** The words read from the EEPROM of a slave, by word address. */
  def eeprom(slave: Int): Map[Int, Int] = {
    var address = 0
    val words   = mutable.Map.empty[Int, Int]
    datagrams.filter(d => d.slaves == Set(slave) && d.reply.workingCounter > 0).foreach { d =>
      if (d.writes && d.reply.ado == 0x0502 && d.reply.length >= 6)
        address = (2 to 5).map(i => d.reply.data(i) << 8 * (i - 2)).sum
      else if (d.reads)
        for (i <- 0 until 4; low <- d.byte(0x0508 + 2 * i); high <- d.byte(0x0509 + 2 * i))
          words.getOrElseUpdate(address + i, low | high << 8)
    }
    words.toMap
  }

  /** An EEPROM image: the words of `base`, the words read, then `configuration`, words 0 to 6, with its
    * checksum. Words never read are 0xFFFF, in the configuration 0.
    */
  def image(slave: Int, configuration: Map[Int, Int], base: Seq[Int] = Nil): Seq[Int] = {
    val read  = eeprom(slave)
    val first = (0 until 7).map(w => configuration.getOrElse(w, 0)).flatMap(w => Seq(w & 0xff, w >> 8))
    val words = (8 to (1023 +: read.keys.toSeq).max).map { w =>
      read.getOrElse(w, if (base.size > 2 * w + 1) base(2 * w) | base(2 * w + 1) << 8 else 0xffff)
    }
    first ++ Seq(SiiCodec.checksum(first), 0) ++ words.flatMap(w => Seq(w & 0xff, w >> 8))
  }

  /** What the slave's firmware put into the mailbox at `address`. */
  def mailbox(slave: Int, address: Int): Seq[Seq[Int]] =
    datagrams
      .filter(d => d.reads && d.slaves == Set(slave) && d.reply.ado == address && d.reply.workingCounter > 0)
      .map(_.reply.data)

  /** For each datagram that polls one of `watched` whether it is the last of its poll: until the same is
    * asked again with a write between that could change it. Others are not in the map.
    */
  def polls(watched: Seq[Watched]): Map[Addressed, Boolean] = watched.flatMap { w =>
    val open = mutable.Map.empty[(Set[Int], Int), Addressed]
    val ends = mutable.Map.empty[Addressed, Boolean]
    datagrams.foreach { d =>
      if (d.reads && d.touches(w.register)) {
        val key = (d.slaves, d.reply.ado)
        open.get(key).foreach(ends(_) = false)
        open(key) = d
        ends(d) = true
      }
      if (w.endedBy.exists(area => d.touches(area)) && (d.writes || w.readsEnd))
        open.filterInPlace((key, _) => key._1.intersect(d.slaves).isEmpty)
    }
    ends
  }.toMap
}

/** Registers a master polls until something slow has happened; a poll ends with a write (or, if `readsEnd`,
  * any access) to one of `endedBy`.
  */
final case class Watched(name: String, register: Range, endedBy: Seq[Range], readsEnd: Boolean = false)
