package flyframe.dc

import chisel3._
import chisel3.util._
import flyframe.memory.{RegisterBus, RegisterUnit, StampRequest}
import flyframe.params.EscParams
import flyframe.registers.ClockRegisters

/** What a port tells the clocks.
  *
  * @param receives
  *   a nibble of a frame comes in
  * @param link
  *   there is one
  */
final case class PortActivity(receives: Bool, link: Bool)

/** Distributed clocks behind their registers: the receive times of frames (DC-03 to DC-08).
  *
  * @param ports
  *   all, by their numbers
  * @param request
  *   what the frame in the processing unit asks for
  */
class DistributedClocks(p: EscParams, ports: Seq[PortActivity], request: StampRequest)
    extends RegisterUnit(ClockRegisters(p)) {

  def connect(bus: RegisterBus): Unit = {
    val clock = Module(new LocalClock(p.clockPeriodNs, p.clockBytes)).suggestName("localClock")
    val times =
      Module(new ReceiveTimes(p.ports, p.clockPeriodNs, p.clockBytes, p.lanes)).suggestName("receiveTimes")
    times.timeByte := clock.timeByte
    times.place    := clock.place
    times.last     := clock.last
    // A frame at a port, and that frame in the processing unit behind it, begin in the same cycle.
    times.begins := VecInit(
      ports.map(y => y.receives && !RegNext(y.receives, false.B)) :+ bus.frame.begins
    )
    times.absent := VecInit(ports.map(!_.link))

    // What the frame has asked for counts when it ends well.
    val asked   = RegInit(false.B) // reset: no frame
    val ofPorts = RegInit(false.B) // reset: no frame
    when(request.written) {
      asked := true.B
      when(request.ofPorts) { ofPorts := true.B }
    }
    when(bus.frame.good || bus.frame.bad || bus.frame.begins) {
      asked   := false.B
      ofPorts := false.B
    }
    times.keep := VecInit(Seq.fill(p.ports)(bus.frame.good && ofPorts) :+ (bus.frame.good && asked))

    val read = bus.keptRead
    times.readWord := read.address
    read.data      := times.data
  }
}
