package flyframe.model

import flyframe.protocol.Command._
import flyframe.protocol.{DatagramLayout, EtherType}

/** What the processing unit needs of the controller around it. */
trait AddressSpace {

  /** The command of the datagram whose accesses follow. */
  def executes(command: Int): Unit = ()

  /** The byte as ECAT reads it, if it may. */
  def read(address: Int): Option[Int]

  /** ECAT writes a byte; false if it may not. Memory changes at once, registers when the frame has ended
    * well.
    */
  def write(address: Int, byte: Int): Boolean = claim(address).exists(store => store(byte, 0xff))

  /** ECAT wants to write a byte: None if it may not, else what writes it, given the byte and the bits of it
    * that count (FMMU-10). That gives false if it may not after all.
    */
  def claim(address: Int): Option[(Int, Int) => Boolean]

  /** What reading has closed since this was asked last; to be carried out when the byte passes for which it
    * was read.
    */
  def closings(): () => Unit = () => ()
}

/** Settings of the processing unit for one frame; `readWriteOffset` as the register says (B-113). */
final case class ProcessingSettings(
    stationAddress: Int,
    alias: Option[Int],
    destroyForeign: Boolean,
    circulating: Boolean,
    ecatEvents: Int,
    maxSubTelegrams: Int,
    fmmus: Seq[FmmuModel] = Nil,
    readWriteOffset: Int = 0
)

/** What comes out: the nibbles, whether the frame is (now) in error, and whether it had more datagrams than
  * are processed.
  */
final case class Processed(payload: Vector[Int], bad: Boolean, tooMany: Boolean)

/** The ECAT processing unit on a whole frame: sections 2 to 7 of the specification, B-10 to B-21.
  *
  * It looks at the frame as it came in and writes into a copy. A frame may end anywhere, even within a byte:
  * then the nibbles that are there are processed as far as they go.
  */
class ProcessingUnit(settings: ProcessingSettings, space: AddressSpace) {
  import ProcessingUnit._

  def process(payload: Vector[Int], alreadyBad: Boolean): Processed = new Run(payload, alreadyBad).result

  private class Run(in: Vector[Int], alreadyBad: Boolean) {
    private val out        = in.toArray
    private val wholeBytes = in.size / 2

    private def has(byte: Int): Boolean   = byte < wholeBytes
    private def begun(byte: Int): Boolean = 2 * byte < in.size
    private def nibble(i: Int): Int       = if (i < in.size) in(i) else 0
    private def byteIn(i: Int): Int       = nibble(2 * i) | nibble(2 * i + 1) << 4
    private def little(i: Int): Int       = byteIn(i) | byteIn(i + 1) << 8
    private def big(i: Int): Int          = byteIn(i) << 8 | byteIn(i + 1)
    private def put(i: Int, byte: Int): Unit = {
      if (2 * i < out.length) out(2 * i) = byte & 0xf
      if (2 * i + 1 < out.length) out(2 * i + 1) = byte >> 4 & 0xf
    }
    private def putLittle(i: Int, word: Int): Unit = {
      put(i, word & 0xff)
      put(i + 1, word >> 8 & 0xff)
    }

    private def destroyedAfter(byte: Int): Processed =
      Processed(out.take(2 * byte + 2).toVector, bad = true, tooMany = false)
    private def passed(bad: Boolean): Processed = Processed(out.toVector, alreadyBad || bad, tooMany = false)
    private def foreignAt(byte: Int): Processed =
      if (settings.destroyForeign) destroyedAfter(byte) else passed(bad = false)

    private def putNibble(i: Int, value: Int): Unit = if (i < out.length) out(i) = value

    val result: Processed = {
      if (settings.destroyForeign) putNibble(12, nibble(12) | 2) // SOURCE_MAC[1], FP-09
      ethernet()
    }

    private def ethernet(): Processed = {
      val typeAt =
        if (has(13) && big(12) == EtherType.Vlan) 16 else 12 // FP-03: the tag itself does not matter
      if (!has(typeAt + 1)) passed(bad = true)
      else
        big(typeAt) match {
          case EtherType.EtherCat => ethercat(typeAt + 2, foreignAt)
          case EtherType.Ipv4     => ip(typeAt + 2)
          case _                  => foreignAt(typeAt + 1)
        }
    }

    /** FP-04: version 4 with a header of 5 words, protocol UDP, destination port. */
    private def ip(start: Int): Processed = {
      val tests = Seq[(Int, Boolean)](
        start        -> (byteIn(start) == 0x45),
        (start + 9)  -> (byteIn(start + 9) == 0x11),
        (start + 23) -> (big(start + 22) == EtherType.EtherCat)
      )
      tests
        .collectFirst {
          case (byte, _) if !has(byte) => passed(bad = true)
          case (byte, false)           => foreignAt(byte)
        }
        .getOrElse {
          putLittle(start + 26, 0) // UDP checksum, FP-05
          if (has(start + 27)) ethercat(start + 28, byte => foreignUdp(start + 20, byte))
          else passed(bad = true)
        }
    }

    /** B-12: not EtherCAT after all, but the checksum of the UDP datagram at `start` is cleared. */
    private def foreignUdp(start: Int, byte: Int): Processed = {
      val length = big(start + 4) & 0xfff
      if (settings.destroyForeign) destroyedAfter(byte)
      else if (length < 10) passed(bad = true)
      else ending(start + length, 0)
    }

    private def ethercat(start: Int, otherType: Int => Processed): Processed =
      if (!has(start + 1)) passed(bad = true)
      else if (little(start) >> 12 != 1) otherType(start + 1)
      else datagrams(start + 2, 0)

    /** From the datagram with number `index` at byte `start` on. */
    @annotation.tailrec
    private def datagrams(start: Int, index: Int): Processed = {
      val mine   = index < settings.maxSubTelegrams
      val length = little(start + 6) & 0x7ff
      val circle = settings.circulating && mine && has(start + 7)
      val end    = start + DatagramLayout.Overhead + length
      if (mine) increment(start)
      if (circle && (little(start + 6) & Circulating) != 0) destroyedAfter(start + 7) // LP-15, OP-03
      else {
        if (circle) putLittle(start + 6, little(start + 6) | Circulating)
        if (mine) {
          if (begun(start + 8)) putLittle(start + 8, little(start + 8) | settings.ecatEvents)
          if (has(start + 7)) execute(start, length)
        }
        if (!has(end - 1)) passed(bad = true)
        else if ((little(start + 6) & More) != 0) datagrams(end, index + 1)
        else ending(end, index + 1)
      }
    }

    /** FP-22. */
    private def increment(start: Int): Unit =
      if (has(start) && IncrementsAdp(byteIn(start))) putLittle(start + 2, little(start + 2) + 1 & 0xffff)

    /** Section 5: what the datagram does here; section 6: what it counts. */
    private def execute(start: Int, length: Int): Unit = {
      val command = byteIn(start)
      space.executes(command)
      if (Logical(command)) logical(start, length, command)
      else physical(start, length, command)
    }

    private def physical(start: Int, length: Int, command: Int): Unit = {
      val adp = little(start + 2)
      val ado = little(start + 4)
      val matches = command match {
        case Aprd | Apwr | Aprw | Armw => adp == 0
        case Fprd | Fpwr | Fprw | Frmw => adp == settings.stationAddress || settings.alias.contains(adp)
        case Brd | Bwr | Brw           => true
        case _                         => false
      }
      val (reads, writes) = command match {
        case Aprd | Fprd | Brd => (matches, false)
        case Apwr | Fpwr | Bwr => (false, matches)
        case Aprw | Fprw | Brw => (matches, matches)
        case Armw | Frmw       => (matches, !matches)
        case _                 => (false, false)
      }
      val broadcast = Set(Brd, Bwr, Brw)(command)
      val both      = Set(Aprw, Fprw, Brw)(command)
      val target    = ado + (if (both) settings.readWriteOffset else 0)
      transfer(
        start,
        length,
        i =>
          if (i >= 0 && reads)
            space.read(ado + i).map(v => (received: Int) => if (broadcast) received | v else v)
          else None,
        (_, _) => (),
        (i, byte) => i >= 0 && writes && space.write(target + i, byte),
        writeCounts = if (both) 2 else 1
      )
    }

    private def logical(start: Int, length: Int, command: Int): Unit = {
      val address = (little(start + 2) | little(start + 4).toLong << 16) & 0xffffffffL
      val access  = new LogicalAccess(address, length, settings.fmmus, space)
      transfer(
        start,
        length,
        i => if (command != Lwr) access.read(i) else None,
        (i, byte) => if (command != Lrd) access.writeLower(i, byte),
        (i, byte) => command != Lrd && access.write(i, byte),
        writeCounts = if (command == Lrw) 2 else 1
      )
    }

    /** All data bytes in the order of time, and the working counter. Reading looks ahead: a byte is accessed
      * when the last but one before it has passed (B-55). Byte -1, the last of the header, is where byte 0
      * may need something early.
      *
      * @param read
      *   what to make of byte number `i`, if it can be read
      * @param writeFirst
      *   writes what of byte number `i` is written before byte `i + 1` is read
      * @param write
      *   writes byte number `i`; false if it may not
      */
    private def transfer(
        start: Int,
        length: Int,
        read: Int => Option[Int => Int],
        writeFirst: (Int, Int) => Unit,
        write: (Int, Int) => Boolean,
        writeCounts: Int
    ): Unit = {
      val data         = start + DatagramLayout.bytes
      var readSuccess  = false
      var writeSuccess = false
      def readByte(i: Int): Unit = if (i < length && has(data + i - 2)) read(i).foreach { change =>
        put(data + i, change(byteIn(data + i)))
        readSuccess = true
      }
      if (length > 0) readByte(-1)
      for (i <- -1 until length if length > 0 && has(data + i - 1)) {
        val close = space.closings()
        if (has(data + i)) writeFirst(i, byteIn(data + i))
        readByte(i + 1)
        close()
        if (has(data + i) && write(i, byteIn(data + i))) writeSuccess = true
      }
      val count = (if (readSuccess) 1 else 0) + (if (writeSuccess) writeCounts else 0)
      putLittle(data + length, little(data + length) + count & 0xffff)
    }

    /** Padding and FCS, from byte `end` of the frame on. */
    private def ending(end: Int, count: Int): Processed = {
      val fcs = end max 60 // B-13
      if (begun(fcs)) {
        def bytes(nibbles: Int => Int) = (0 until fcs).map(i => nibbles(2 * i) | nibbles(2 * i + 1) << 4)
        Fcs.change(bytes(in), bytes(out)).zipWithIndex.foreach { case (c, i) =>
          put(fcs + i, byteIn(fcs + i) ^ c)
        }
      }
      val trailing = wholeBytes - end
      passed(bad = trailing < 4 || trailing > 68).copy(tooMany = count > settings.maxSubTelegrams)
    }
  }
}

object ProcessingUnit {
  private val Circulating   = 1 << 14
  private val More          = 1 << 15
  private val IncrementsAdp = Set(Aprd, Apwr, Aprw, Brd, Bwr, Brw, Armw)
  private val Logical       = Set(Lrd, Lwr, Lrw)
}
