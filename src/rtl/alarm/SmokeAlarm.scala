package flyframe.alarm

import chisel3._
import chisel3.util._
import flyframe.frame.{FramePosition, Stage}
import flyframe.lanes.Lanes
import flyframe.memory.{RegisterBus, RegisterUnit}
import flyframe.mii.NibbleStream
import flyframe.params.EscParams
import flyframe.protocol.AppendedLayout
import flyframe.registers.AlarmRegisters

/** What makes a slave an alarm slave: [[AlarmUnit]] behind its registers, and [[DatagramAppender]] on the
  * wire path, by which it reports.
  */
class SmokeAlarm(p: EscParams) extends RegisterUnit(AlarmRegisters.all) with Stage {

  /** Smoke detector, buzzer and lamp. */
  val pins: AlarmPins = IO(new AlarmPins).suggestName("alarm")

  private val unit = Module(new AlarmUnit(p)).suggestName("alarmUnit")
  private val appender =
    Module(new DatagramAppender(AppendedLayout.bytes, p.maxSubTelegrams)).suggestName("appender")

  /** Frames may get a datagram of this slave (AP-01). */
  def pass(step: Bool, in: NibbleStream, position: FramePosition): NibbleStream = {
    appender.step     := step
    appender.in       := in
    appender.position := position
    appender.pending  := unit.pending
    appender.data     := unit.data
    unit.busy         := appender.busy
    unit.nibble       := appender.nibble
    unit.nextWord     := appender.nextByte >> 1
    unit.reads        := appender.reads
    unit.begins       := appender.begins
    unit.takes        := appender.takes
    appender.out
  }

  def connect(bus: RegisterBus): Unit = {
    unit.pins <> pins
    unit.detect        := bus.bool("detector_enable")
    unit.debounce      := bus.value("detector_debounce")
    unit.changes       := RegNext(bus.writes("detector_debounce"), false.B)
    unit.offTime       := bus.value("detector_off_time")
    unit.selfTest      := bus.value("self_test")
    unit.epoch         := bus.value("alarm_epoch")
    unit.node          := bus.value("station_alias")
    unit.registersBusy := bus.writesPending
    unit.silence       := bus.order("alarm_silence")
    unit.restart       := bus.order("detector_restart")
    for (
      (name, port) <- Seq(
        "detector_mode"    -> unit.mode,
        "detector_seconds" -> unit.seconds,
        "host_alive"       -> unit.hostAlive
      )
    ) {
      port.value    := bus.value(name)
      bus.set(name) := port.load
    }

    // All bytes are there a cycle after the last one is written.
    def comes(register: String) = RegNext(bus.completes(register), false.B)
    // Orders stay as they were written last. Reset: 0, which is the number of no record; a life that ends.
    def kept(field: String): UInt = {
      bus.status(field) := 0.U
      Cat(bus.writtenBytes(field).zipWithIndex.reverse.map { case (byte, i) =>
        RegEnable(byte.bits, 0.U(8.W), byte.valid).suggestName(s"${field}_$i")
      })
    }
    unit.acknowledge.valid         := comes("alarm_acknowledge")
    unit.acknowledge.bits.sequence := kept("acknowledge_sequence")
    unit.acknowledge.bits.guard    := kept("acknowledge_guard")
    unit.acknowledge.bits.tag      := kept("acknowledge_tag")
    unit.acknowledgeChanges        := bus.writes("alarm_acknowledge")
    unit.confirm.valid             := comes("alarm_confirm")
    unit.confirm.bits              := kept("confirm_number")
    unit.confirmChanges            := bus.writes("alarm_confirm")
    val life = kept("confirm_life")
    unit.newMaster := bus
      .writtenBytes("confirm_life")
      .zipWithIndex
      .map { case (byte, i) => byte.valid && byte.bits =/= Lanes.byte(life, i) }
      .reduce(_ || _)

    bus.status("slave_status")    := unit.status
    bus.status("slave_node")      := unit.node
    bus.status("slave_self_test") := unit.selfTest
    bus.status("slave_epoch")     := unit.epoch
    bus.status("slave_dropped")   := unit.dropped
    bus.status("slave_links") := VecInit(
      (0 until p.ports).map(y => bus.bool(s"physical_link_port$y"))
    ).asUInt

    for (
      (received, register) <- Seq(
        "broadcast_received" -> "alarm_broadcast",
        "message_received"   -> "alarm_message"
      )
    ) {
      val waits = bus.untilAcknowledged("alarm_messages")(bus.completes(register)).suggestName(received)
      bus.status(received) := waits
      bus.interrupt(waits)
    }
  }
}
