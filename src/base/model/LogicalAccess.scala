package flyframe.model

/** Logical addressing within one datagram: FMMUs between the processing unit and the local addresses (FMMU-05
  * to FMMU-13, B-45 to B-48).
  *
  * A local byte whose bits lie in two logical bytes is accessed once for both: asked for with the first of
  * them, written with the last. Byte -1 is the logical byte before the datagram, whose local bits byte 0 may
  * need.
  */
class LogicalAccess(start: Long, length: Int, fmmus: Seq[FmmuModel], space: AddressSpace) {
  private val readers = fmmus.filter(_.forReads)
  private val writers = fmmus.filter(_.forWrites)

  /** A local byte that the next logical byte has bits of, too. */
  private case class Open[T](fmmu: FmmuModel, address: Int, found: T)
  private var reading: Option[Open[Option[Int]]] = None
  private var writing: Option[Open[Collected]]   = None

  /** Bits of a local byte that have come, and what stores them. */
  private case class Collected(claim: Option[(Int, Int) => Boolean], value: Int = 0, bits: Int = 0) {
    def and(m: MappedByte, byte: Int): Collected =
      copy(value = value | m.toLocal(byte), bits = bits | m.toLocal(0xff))
    def store(): Boolean = claim.exists(_(value, bits))
  }

  /** The local bytes that byte `i` asks for: its own, and the first one that byte `i + 1` needs early. */
  private def asked(among: Seq[FmmuModel], i: Int): Option[(FmmuModel, Seq[MappedByte])] = {
    val here = if (i < 0) None else among.find(_.covers(start + i))
    here.map(f => f -> f.map(start + i)).orElse {
      among
        .find(f => i + 1 < length && f.covers(start + i + 1) && f.needsEarly(start + i + 1))
        .map(f => f -> f.map(start + i + 1).take(1))
    }
  }

  /** The byte to send in place of `received`; None if no bit of it was accessible. */
  def read(i: Int): Option[Int => Int] =
    asked(readers, i).flatMap { case (fmmu, places) =>
      val found = places.map { m =>
        val before = reading.collect {
          case Open(f, address, value) if (f eq fmmu) && address == m.address => value
        }
        m -> before.getOrElse(space.read(m.address))
      }
      reading = found.lastOption.map { case (m, value) => Open(fmmu, m.address, value) }
      val values = if (i >= 0 && fmmu.covers(start + i)) found.collect { case (m, Some(value)) => m -> value }
      else Nil
      Option.when(values.nonEmpty) { received =>
        values.foldLeft(received) { case (byte, (m, value)) => (byte & ~m.mask) | m.toLogical(value) }
      }
    }

  private def opened(fmmu: FmmuModel, m: MappedByte): Option[Collected] = writing.collect {
    case Open(f, address, found) if (f eq fmmu) && address == m.address => found
  }

  /** Writes the local byte whose last bits byte `i` has, if bits before were in another one: this comes
    * before the next byte is read, all else of [[write]] after that (B-48).
    */
  def writeLower(i: Int, byte: => Int): Unit = lower =
    asked(writers, i).filter { case (fmmu, _) => i >= 0 && fmmu.covers(start + i) }.flatMap {
      case (fmmu, places) =>
        places.find(_.isLower).flatMap(m => opened(fmmu, m).map(c => m.address -> c.and(m, byte).store()))
    }
  private var lower: Option[(Int, Boolean)] = None

  /** True if a local byte was written. */
  def write(i: Int, byte: => Int): Boolean =
    asked(writers, i).fold(false) { case (fmmu, places) =>
      val covered = i >= 0 && fmmu.covers(start + i)
      val stored  = lower.filter { case (address, _) => places.exists(_.address == address) }
      val bytes = places.filterNot(m => stored.exists(_._1 == m.address)).map { m =>
        val collected = opened(fmmu, m).getOrElse(Collected(space.claim(m.address)))
        m -> (if (covered) collected.and(m, byte) else collected)
      }
      // The upper one waits for its other bits, if there are any.
      val waits        = !covered || (fmmu.isShifted && !fmmu.isLast(start + i) && i + 1 < length)
      val (now, later) = if (waits) (bytes.dropRight(1), bytes.lastOption) else (bytes, None)
      writing = later.map { case (m, found) => Open(fmmu, m.address, found) }
      now.map { case (_, collected) => collected.store() }.contains(true) || stored.exists(_._2)
    }
}
