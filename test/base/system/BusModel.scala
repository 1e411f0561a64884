package flyframe.system

import flyframe.protocol.DetectorState.Alarm
import flyframe.protocol.{AppendedLayout, ConfirmLayout, DatagramLayout, RecordAckLayout, SlaveStateLayout}

/** An alarm record as it travels (RecordLayout).
  *
  * @param sequence
  *   16 bits, from 1 on
  * @param state
  *   of the detector, with the test bit
  * @param epoch
  *   of the host when it happened, 8 bits
  * @param time
  *   of the slave in us
  */
final case class Record(sequence: Int, state: Int, epoch: Int, time: Long) {

  /** What an acknowledgement must have besides the number. */
  def guard: Int = (time & 0xffff).toInt

  /** A test is no alarm. */
  def isAlarm: Boolean = state == Alarm
}

/** The state of a slave as the master reads it (SlaveStateLayout). */
final case class SlaveBlock(status: Int, node: Int, selfTest: Int, epoch: Int, dropped: Int, links: Int)

/** An acknowledgement that the master sends to a position. */
final case class Acknowledge(position: Int, sequence: Int, guard: Int, tag: Int)

/** An order of the master to a position: bits of `alarm_command`. */
final case class LineOrder(position: Int, bits: Int)

object LineOrder {
  val Silence = 1
  val Reset   = 2
}

/** What a frame of the master has. Positions count from the first slave that reads the frame.
  *
  * @param number
  *   low half of the number of the first event which the server does not have
  * @param life
  *   of the master, low half
  * @param reads
  *   whose state is read
  */
final case class BusFrame(
    number: Int,
    life: Int,
    reads: Seq[Int],
    orders: Seq[LineOrder],
    acknowledges: Seq[Acknowledge]
) {

  /** Bytes of its datagrams. */
  val bytes: Int = {
    def datagram(data: Int) = DatagramLayout.Overhead + data
    datagram(2) + datagram(ConfirmLayout.bytes) + reads.size * datagram(SlaveStateLayout.bytes) +
      orders.size * datagram(1) + acknowledges.size * datagram(RecordAckLayout.bytes)
  }
}

object BusFrame {

  /** Most bytes of datagrams that a frame can have. */
  val Most = 1498

  /** Bytes of a record's datagram. */
  val RecordBytes: Int = AppendedLayout.bytes

  /** Bits on the cable besides the datagrams: preamble, header, FCS. */
  val OtherBits: Int = 8 * (8 + 14 + 2 + 4)
}

/** A record in a frame.
  *
  * @param index
  *   of its slave among those that have read the frame, from 1 on
  */
final case class Appended(index: Int, node: Int, record: Record)

/** A frame as it has come back.
  *
  * @param end
  *   of the line at which it has arrived, 0 or 1
  * @param count
  *   slaves that have read it
  * @param counter
  *   of them alarm slaves
  * @param or
  *   all their status words
  * @param blocks
  *   what the reads have found; none where nobody was
  * @param executed
  *   which orders somebody has taken
  */
final case class BusAnswer(
    end: Int,
    count: Int,
    counter: Int,
    or: Int,
    blocks: Seq[Option[SlaveBlock]],
    executed: Seq[Boolean],
    records: Seq[Appended]
)

/** What a master can do with its line. */
trait Bus {

  /** Sends a frame from an end of the line. No answer: lost, or there is no link. */
  def exchange(end: Int, frame: BusFrame): Option[BusAnswer]
}

/** A slave as a line sees it. */
trait BusSlave {
  def status: Int
  def block: SlaveBlock

  /** A frame passes that has room: the record it takes along. */
  def appended(): Option[Record]

  // What a good frame brings, at its end.
  def confirm(number: Int, life: Int): Unit
  def acknowledge(sequence: Int, guard: Int, tag: Int): Unit
  def command(bits: Int): Unit
}
