package flyframe.port

import chisel3._
import chisel3.util._
import flyframe.memory.{RegisterBus, RegisterUnit}
import flyframe.mii.{NibbleStream, PortSignals}
import flyframe.params.EscParams
import flyframe.protocol.LoopSetting
import flyframe.registers.{DlRegisters, ErrorCounters}

/** The loops of the ports, and what is counted there, behind the registers of the data link layer.
  *
  * @param ports
  *   all, by their numbers
  * @param physical
  *   their links as DL status shows them, before enhanced link detection; asked for by `connect`
  */
class DataLink(p: EscParams, ports: Seq[PortSignals], physical: => Seq[Bool])
    extends RegisterUnit(DlRegisters(p) ++ ErrorCounters(p)) {
  private val loops          = Module(new LoopControl(p)).suggestName("loops")
  private val temporaryLoops = Module(new TemporaryLoops(p)).suggestName("temporaryLoops")

  /** The loop of port 0 is closed by itself (LP-14). */
  val circulating: Bool = loops.circulating

  /** What comes out of the loop of port `y` when `stream` goes in. */
  def through(y: Int, stream: NibbleStream): NibbleStream = {
    val open = loops.open(y)
    loops.quiet(y)  := ports(y).receiverIdle && !stream.busy
    ports(y).toWire := Mux(open, stream, NibbleStream.idle)
    Mux(open, ports(y).fromWire, stream)
  }

  def connect(bus: RegisterBus): Unit = {
    loops.settingWritten        := bus.written("loop_port0").valid // one byte has those of all ports
    temporaryLoops.commitStarts := bus.commits
    temporaryLoops.temporary    := bus.bool("temporary_use")
    bus.set("temporary_use", temporaryLoops.restore, 0.U)
    bus.counts("epu_error") := bus.frame.error
    val shown = physical
    for (y <- 0 until p.ports) {
      val setting = bus.value(s"loop_port$y")
      loops.link(y) := ports(y).link
      // Not before all register writes of a frame are done, so that no loop moves to and fro. Reset: as the
      // register.
      loops.setting(y)          := RegEnable(setting, 0.U, !bus.writesPending)
      loops.goodFrame(y)        := ports(y).events.goodFrame
      temporaryLoops.setting(y) := setting
      bus.set(s"loop_port$y", temporaryLoops.restore, temporaryLoops.former(y))
      bus.status(s"physical_link_port$y") := shown(y)
      bus.status(s"communication_port$y") := ports(y).link
      bus.status(s"loop_closed_port$y")   := loops.reportClosed(y)

      val events = ports(y).events
      val counts = loops.open(y)
      val drops  = RegNext(ports(y).link, false.B) && !ports(y).link
      bus.counts(s"invalid_frame_port$y")   := events.invalidFrame && counts
      bus.counts(s"rx_er_port$y")           := events.rxEr && counts
      bus.counts(s"forwarded_error_port$y") := events.forwardedError && counts
      bus.counts(s"lost_link_port$y")       := drops && counts && setting === LoopSetting.Auto.U
    }
  }
}
