package flyframe.server

import java.nio.ByteBuffer
import java.nio.charset.{CharacterCodingException, CodingErrorAction}
import java.nio.charset.StandardCharsets.UTF_8
import flyframe.can.CanState
import flyframe.protocol.{RingFlag, RingPart, RingResult, RingStatus}

/** Rings in words, for page and log. */
object RingText {

  /** Bytes of a message that are shown. */
  private val MostShown = 256

  /** What is wrong when these bits of a gateway's status are 1. */
  private val faults: Seq[(Int, String)] = Seq(
    RingStatus.Controller -> "The gateway's controller does not answer, or does not hold its settings.",
    RingStatus.Storage    -> "The memory of the gateway's host does not work.",
    RingStatus.Conflict   -> "Another node has the address of the gateway.",
    RingStatus.Alone      -> "No port of the gateway is up: it hears no node.",
    RingStatus.Full       -> "Messages wait at the gateway: those before are not in this log yet."
  )

  def notices(status: Int): Seq[String] = faults.collect { case (bit, text) if (status & bit) != 0 => text }

  /** What a node's ring state and CAN status say, the most urgent first; empty: all is well. */
  def node(n: RingNode): Seq[String] = if (!n.present) Seq("lost")
  else {
    val ports = (n.isUp(1), n.isUp(2)) match {
      case (true, true)   => Nil
      case (false, true)  => Seq("port 1 down")
      case (true, false)  => Seq("port 2 down")
      case (false, false) => Seq("both ports down")
    }
    val state = Seq(0x10 -> "address conflict", 0x20 -> "drive cut off", 0x04 -> "guard")
      .collect { case (bit, text) if (n.state & bit) != 0 => text }
    val stuck =
      Seq(0x08 -> "port 1 stuck", 0x80 -> "port 2 stuck").collect { case (b, t) if (n.ports & b) != 0 => t }
    def can(name: String, status: Int) = status & 3 match {
      case CanState.Passive => Seq(s"$name error passive")
      case CanState.BusOff  => Seq(s"$name bus-off")
      case _                => Nil
    }
    state.filter(_ != "guard") ++ stuck ++ can("CAN F", n.can._1) ++ can("CAN T", n.can._2) ++ ports ++
      state.filter(_ == "guard")
  }

  def ends(ends: Option[(Int, Int)]): String = ends match {
    case None                   => "ring whole"
    case Some((a, b)) if a == b => s"${nodeName(a)} is alone: it hears no other"
    case Some((a, b))           => s"ring broken between ${nodeName(a)} and ${nodeName(b)}"
  }

  private def nodeName(address: Int) = if (address == 0) "an unknown node" else s"node $address"

  def result(code: Int): String = code match {
    case RingResult.Delivered    => "delivered"
    case RingResult.Refused      => "refused"
    case RingResult.NotConfirmed => "not confirmed"
    case other                   => s"unknown result $other"
  }

  /** Bytes as text, if they are some, else as hexadecimal digits; of a long message its beginning. */
  def data(bytes: Seq[Byte]): String = if (bytes.size > MostShown) {
    // Not within a character, of which all bytes but the first begin with 10.
    val end = (MostShown to MostShown - 3 by -1).find(i => (bytes(i) & 0xc0) != 0x80).getOrElse(MostShown)
    s"${data(bytes.take(end))} … (${bytes.size} bytes)"
  } else {
    val decoder =
      UTF_8.newDecoder
        .onMalformedInput(CodingErrorAction.REPORT)
        .onUnmappableCharacter(CodingErrorAction.REPORT)
    val text =
      try Some(decoder.decode(ByteBuffer.wrap(bytes.toArray)).toString)
      catch { case _: CharacterCodingException => None }
    text
      .filter(t => t.nonEmpty && t.forall(isShown))
      .fold(bytes.map(b => f"${b & 0xff}%02x").mkString)(t => s"“$t”")
  }

  /** Neither a control character nor one that changes how its neighbours are shown. */
  private def isShown(c: Char): Boolean = !c.isControl && Character.getType(c) != Character.FORMAT.toInt

  /** What a part says that the log has. */
  def part(p: Part, whole: Seq[Byte], isCut: Boolean): String = p.kind match {
    case RingPart.Message =>
      val urgent = if ((p.flags & RingFlag.Urgent) != 0) "urgent message" else "message"
      val all    = if ((p.lifeByte & 0x80) != 0) " to all" else ""
      val repeat = if (p.isRepeat) ", may be a repeat" else ""
      val cut    = if (isCut) "(its beginning is missing) " else ""
      s"$urgent of node ${p.source}$all$repeat: $cut${data(whole)}"
    case RingPart.Node =>
      RingNode(p.data).fold(s"node ${p.source}: not understood") { n =>
        val words = node(n)
        s"node ${p.source}: ${if (words.isEmpty) "all well" else words.mkString(", ")}"
      }
    case RingPart.Ring => ends(Ring(0).told(p.kind, p.source, p.data).ends)
    case RingPart.Result if p.data.size == 5 =>
      s"message ${number(p.data)} of the server: ${result(p.data(4) & 0xff)}"
    case other => s"part of unknown kind $other"
  }

  /** The counter in a result. */
  def number(data: Seq[Byte]): Long = data.take(4).foldLeft(0L)((n, b) => n << 8 | b & 0xff)
}
