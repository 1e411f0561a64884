package flyframe.protocol

import java.nio.ByteOrder

/** What the bytes of a record or a datagram are: fields, one behind the other without gaps. RTL, model and
  * server take places and widths from here, the firmware from the generated header `protocol.h`.
  *
  * @param name
  *   the beginning of its names in the header, in lower case
  * @param meaning
  *   a phrase for the header
  * @param order
  *   of the bytes of a number
  */
abstract class Layout(val name: String, val meaning: String, val order: ByteOrder) {
  private var listed = Vector.empty[Layout.Field]

  /** All fields, the first byte first. */
  def fields: Seq[Layout.Field] = listed

  /** Bytes of all fields. */
  def bytes: Int = listed.lastOption.fold(0)(_.end)

  /** Adds a field behind the others. */
  protected def field(name: String, bytes: Int, meaning: String): Layout.Field = {
    require(!listed.exists(_.name == name), s"The field $name stands twice in ${this.name}.")
    listed :+= Layout.Field(name, this.bytes, bytes, meaning)
    listed.last
  }

  /** The bytes with these numbers in their fields; all other fields are 0. */
  def encode(values: (Layout.Field, Long)*): Array[Byte] = {
    val result = new Array[Byte](bytes)
    for ((field, value) <- values; i <- 0 until field.bytes)
      result(field.offset + i) = (value >> (8 * significance(field, i))).toByte
    result
  }

  /** The number in a field; of eight bytes as a signed one.
    *
    * @param start
    *   where in `data` the first field begins
    */
  def read(data: Array[Byte], field: Layout.Field, start: Int = 0): Long =
    (0 until field.bytes).map { i =>
      (data(start + field.offset + i) & 0xffL) << (8 * significance(field, i))
    }.sum

  /** How many bytes of the number are lower than its byte `i`. */
  private def significance(field: Layout.Field, i: Int): Int =
    if (order == ByteOrder.BIG_ENDIAN) field.bytes - 1 - i else i
}

object Layout {

  /** Some bytes with one meaning.
    *
    * @param offset
    *   of its first byte
    */
  final case class Field(name: String, offset: Int, bytes: Int, meaning: String) {

    /** Offset of its last byte. */
    def last: Int = end - 1

    /** Offset of what stands behind it. */
    def end: Int = offset + bytes

    /** Number of the 16-bit word that it stands in, or begins with. */
    def word: Int = offset / 2
  }

  /** Every layout, in the order of the header. */
  def all: Seq[Layout] = Seq(
    ReportLayout,
    ReportedSlaveLayout,
    EventLayout,
    ReportEndLayout,
    AnswerLayout,
    NonceLayout,
    RingReportLayout,
    RingPartLayout,
    RingReportEndLayout,
    RingSendLayout,
    HostEventLayout,
    RecordLayout,
    RecordAckLayout,
    ConfirmLayout,
    SlaveStateLayout,
    DatagramLayout,
    AppendedLayout
  )
}
