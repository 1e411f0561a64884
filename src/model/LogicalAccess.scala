package flyframe.model

/** Logical addressing within one datagram: FMMUs between the processing unit and the local addresses (FMMU-05
  * to FMMU-13, B-45 to B-48).
  */
class LogicalAccess(fmmus: Seq[FmmuModel], space: AddressSpace) {
  private val readers = fmmus.filter(_.forReads)
  private val writers = fmmus.filter(_.forWrites)

  // The local byte written last, as far as it is known: its neighbour brings its other bits (FMMU-02).
  private var last: Option[(FmmuModel, Int, Int)] = None

  /** The byte to send in place of `received`; None if no bit of it was accessible. */
  def read(logical: Long): Option[Int => Int] =
    readers.find(_.covers(logical)).flatMap { fmmu =>
      val found = for { m <- fmmu.map(logical); value <- space.read(m.address) } yield m -> value
      Option.when(found.nonEmpty) { received =>
        found.foldLeft(received) { case (byte, (m, value)) => (byte & ~m.mask) | m.toLogical(value) }
      }
    }

  /** True if a byte was accessible. */
  def write(logical: Long, byte: Int): Boolean =
    writers.find(_.covers(logical)).fold(false) { fmmu =>
      val before = last.collect { case (f, address, value) if f eq fmmu => address -> value }
      last = None
      fmmu
        .map(logical)
        .map { m =>
          val value = m.toLocal(byte) | before.filter(_._1 == m.address).fold(0)(_._2)
          last = Some((fmmu, m.address, value))
          space.write(m.address, value)
        }
        .contains(true)
    }
}
