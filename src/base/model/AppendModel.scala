package flyframe.model

import flyframe.protocol.DatagramLayout.{Adp, Index, Length, Overhead}
import flyframe.protocol.EtherType

/** A datagram is appended to a passing frame (AP-01 to AP-08): the frame as a whole, not its timing. */
object AppendModel {
  private val Longest = 1498 // of the EtherCAT length field in an Ethernet frame

  /** The frame that leaves.
    *
    * @param bad
    *   it is in error
    * @param insertedAt
    *   nibble at which the datagram begins, if it is there
    */
  final case class Result(payload: Vector[Int], bad: Boolean, insertedAt: Option[Int] = None)

  /** @param payload
    *   nibbles behind the SFD, FCS included, behind the processing unit
    * @param bad
    *   the frame is in error
    * @param datagram
    *   its bytes, where the index does not matter: it becomes the position of the slave (AP-05)
    */
  def append(payload: Vector[Int], bad: Boolean, datagram: Seq[Int], maxSubTelegrams: Int): Result = {
    def byte(i: Int): Option[Int] =
      Option.when(2 * i + 1 < payload.size)(payload(2 * i) | payload(2 * i + 1) << 4)
    def big(i: Int): Option[Int]    = for (a <- byte(i); b <- byte(i + 1)) yield a << 8 | b
    def little(i: Int): Option[Int] = for (a <- byte(i); b <- byte(i + 1)) yield a | b << 8

    val typeAt = if (big(12).contains(EtherType.Vlan)) 16 else 12
    val start  = typeAt + 4
    val fits = for (ethertype <- big(typeAt); header <- little(start - 2)) yield {
      val length = header & 0xfff
      ethertype == EtherType.EtherCat && header >> 12 == 1 && (length == 0 || length >= Overhead) &&
      length + datagram.size <= Longest && length < Overhead * maxSubTelegrams
    }
    if (!fits.contains(true)) Result(payload, bad)
    else {
      val length                         = little(start - 2).get & 0xfff
      val (whole, dribble)               = payload.splitAt(payload.size / 2 * 2)
      val body                           = whole.dropRight(8).toArray // the FCS is made anew
      def put(i: Int, nibble: Int): Unit = if (i < body.length) body(i) = nibble
      for (k <- 0 until 3) put(2 * (start - 2) + k, (length + datagram.size) >> (4 * k) & 0xf)

      // The datagrams, by their own lengths; the last one now says that more follow.
      @annotation.tailrec
      def behind(begin: Int): Option[Int] = little(begin + Length.offset) match {
        case None => None
        case Some(word) =>
          val more = (word & 0x8000) != 0
          if (!more) put(2 * (begin + Length.last) + 1, word >> 12 | 8)
          val next = begin + Overhead + (word & 0x7ff)
          if (more) behind(next) else Some(next)
      }
      val end      = if (length == 0) Some(start) else behind(start)
      val wrong    = length != 0 && end.exists(e => 2 * e < payload.size && e != start + length)
      val position = if (length == 0) 0 else byte(start + Adp.offset).getOrElse(0)
      val added    = datagram.updated(Index.offset, position).flatMap(b => Seq(b & 0xf, b >> 4)).toVector
      val place    = end.filter(2 * _ <= body.length)
      val filled = place match {
        case Some(e) => body.take(2 * e).toVector ++ added ++ body.drop(2 * e + added.size)
        case None    => body.toVector
      }
      val bytes = filled.grouped(2).map(n => n(0) | n(1) << 4).toSeq
      val isBad = bad || wrong
      val fcs   = Fcs.of(bytes).map(_ ^ (if (isBad) 0xff else 0)).flatMap(b => Seq(b & 0xf, b >> 4))
      Result(filled ++ fcs ++ dribble, isBad, place.map(2 * _))
    }
  }
}
