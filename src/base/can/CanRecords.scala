package flyframe.can

/** What a port remembers of errors (CAN-46, CB-10). */
class CanRecords {
  import CanRecords._
  private val counters = Array.fill(Count)(0)

  var errorType: Int    = CanError.None
  var asSender: Boolean = false
  var errorField: Int   = 0
  var errorBit: Int     = 0

  /** Bit of the last lost arbitration, from 1. */
  var lostBit: Int = 0

  private def count(which: Int): Unit = counters(which) = (counters(which) + 1) min 255

  def error(kind: Int, sender: Boolean, field: Int, bit: Int): Unit = {
    errorType = kind
    asSender = sender
    errorField = field
    errorBit = bit
    count(kind - CanError.Bit)
  }

  def lost(bit: Int): Unit = {
    lostBit = bit
    count(LostArbitrations)
  }

  def overrun(): Unit = count(Overruns)
  def busOff(): Unit  = count(BusOffs)

  /** Frames of the other port that were dropped (BR-02). */
  var bridgeDropped: Int   = 0
  def dropInBridge(): Unit = bridgeDropped = (bridgeDropped + 1) min 255

  /** Counter `which`, in the order of the registers. */
  def counter(which: Int): Int = counters(which)

  def clear(): Unit = {
    for (i <- counters.indices) counters(i) = 0
    errorType = CanError.None
    asSender = false
    errorField = 0
    errorBit = 0
    lostBit = 0
    bridgeDropped = 0
  }
}

object CanRecords {
  private val LostArbitrations = 5
  private val Overruns         = 6
  private val BusOffs          = 7
  private val Count            = 8
}
