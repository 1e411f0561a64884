package flyframe.model

import flyframe.params.EscParams
import flyframe.protocol.Command
import flyframe.registers.ClockRegisters

/** Distributed clocks: the receive times of frames (DC-07, DC-08). Its time is that of the bench, in which a
  * frame comes as a whole: the beginning of each frame is right, as far as the bench tells the time between
  * them.
  */
class ClockModel(p: EscParams, registers: ModelRegisters, hasLink: Int => Boolean) extends ModelUnit {
  private var now    = 0L
  private val began  = Array.fill(p.ports)(Option.empty[Long]) // since a frame came to the processing unit
  private val awaits = Array.fill(p.ports)(false)              // the frame is on its way back to there
  private var latest = Option.empty[(Int, Long)]               // port and time of the frame at hand

  // What the frame in the processing unit has written 0x0900 with.
  private var commands = Set.empty[Int]

  /** Lets time pass, ns. */
  def advance(ns: Long): Unit = now += ns

  /** A time, of which a bench without a common clock knows nothing. */
  def isTime(address: Int): Boolean =
    registers.register(address).exists(r => ClockRegisters(p).exists(_.name == r.name))

  /** A frame begins at `port`. */
  def portBegins(port: Int): Unit = {
    latest = Some(port -> now)
    began(port) = Some(now)
    if (awaits(port)) keep(port, now)
  }

  /** The frame at hand enters the processing unit. */
  def processingBegins(): Unit = {
    for (port <- began.indices) began(port) = latest.collect { case (`port`, time) => time }
    commands = Set.empty
  }

  /** It writes the byte at `address`. */
  def isWritten(address: Int, command: Int): Unit =
    if (address == ClockRegisters.Trigger) commands += command

  /** It is over, and its times are to be kept if it asked for that. */
  def frameEnds(good: Boolean): Unit = {
    if (good && commands.nonEmpty)
      for ((_, time) <- latest) {
        val mask = if (p.clockBits == 64) -1L else 0xffffffffL
        registers.setWide("receive_time_processing_unit", time & mask)
      }
    if (good && commands.exists(Set(Command.Bwr, Command.Fpwr)))
      for (port <- began.indices) began(port) match {
        case Some(time) => keep(port, time)
        case None       => awaits(port) = hasLink(port)
      }
    commands = Set.empty
  }

  /** Its link goes down: nothing comes back from there. */
  def portGoes(port: Int): Unit = awaits(port) = false

  private def keep(port: Int, time: Long): Unit = {
    awaits(port) = false
    ClockRegisters.port(port).foldLeft(time) { case (left, (field, bytes)) =>
      registers.setWide(field, left & ((1L << (8 * bytes)) - 1))
      left >> (8 * bytes)
    }
  }
}
