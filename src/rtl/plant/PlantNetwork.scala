package flyframe.plant

import chisel3._
import flyframe.ethernet._
import flyframe.memory.HostPort
import flyframe.mii.NibbleStream
import flyframe.ram.DualPortRam

/** What happens at the plant port, a pulse each. */
class PlantEvents extends Bundle {
  val received = Bool()
  val sent     = Bool()
  val link     = Bool()
}

/** A ring node towards the plant network (GW-04): datagrams that the host has made go to the server, those of
  * the server wait for the host, and ARP requests are answered.
  */
class PlantNetwork extends Module {

  /** Once per nibble slot: `in` is to be taken. */
  val step = IO(Input(Bool()))
  val in   = IO(Input(new NibbleStream))
  val out  = IO(Output(new NibbleStream))
  val link = IO(Input(Bool()))

  /** A bad frame has come. */
  val badFrame = IO(Input(Bool()))

  val host   = IO(new HostPort(4))
  val events = IO(Output(new PlantEvents))

  private val receiver  = Module(new EthernetReceiver)
  private val expected  = Module(new ExpectedByte)
  private val udp       = Module(new UdpReceiver)
  private val arp       = Module(new ArpResponder)
  private val datagrams = Module(new DatagramStore)
  private val maker     = Module(new UdpSender)
  private val sender    = Module(new EthernetSender)
  private val settings  = Module(new NetworkSettings(3))
  private val registers = Module(new PlantHost)
  registers.host <> host

  // Frames that come; whether they are heard changes between two. Reset: they are not.
  private val hears = RegInit(false.B)
  when(step && !in.valid) { hears := registers.run }
  receiver.step := step && hears
  receiver.in   := in
  expected.byte := receiver.byte
  expected.end  := receiver.end
  udp.byte      := receiver.byte
  udp.first     := receiver.first
  udp.end       := receiver.end
  udp.at        := expected.at
  udp.same      := expected.same
  udp.mine      := expected.mine
  arp.byte      := receiver.byte
  arp.first     := receiver.first
  arp.end       := receiver.end
  arp.at        := expected.at
  arp.same      := expected.same
  arp.mine      := expected.mine

  datagrams.data        := udp.data
  datagrams.offset      := udp.offset
  datagrams.received    := udp.received
  datagrams.release     := registers.release
  datagrams.readAddress := registers.readAddress
  registers.waiting     := datagrams.waiting
  registers.length      := datagrams.length
  registers.readData    := datagrams.readData

  // Frames that go: settings and wire belong to one of both until he is done. Reset: to nobody.
  private val sends   = RegInit(false.B)
  private val answers = RegInit(false.B)
  sends         := Mux(sends, maker.busy, maker.busy && !answers)
  answers       := Mux(answers, arp.wants, arp.wants && !sends && !maker.busy)
  maker.granted := sends
  arp.granted   := answers

  maker.go                 := registers.send
  maker.length             := registers.sendLength
  registers.sending        := maker.busy
  registers.payloadAddress := maker.payloadAddress
  maker.payload            := registers.payload

  // Who asks.
  private val asker = DualPortRam(32, 8)(clock)
  asker.io.write        := arp.note.valid
  asker.io.writeAddress := arp.noteAddress
  asker.io.writeData    := arp.note.bits
  asker.io.readAddress  := arp.readAddress
  arp.asker             := asker.io.readData

  sender.step        := step
  sender.bytes.valid := Mux(answers, arp.bytes.valid, maker.bytes.valid)
  sender.bytes.bits  := Mux(answers, arp.bytes.bits, maker.bytes.bits)
  arp.bytes.ready    := sender.bytes.ready && answers
  maker.bytes.ready  := sender.bytes.ready && sends
  out                := sender.out

  settings.write        := registers.settingWrite
  settings.writeAddress := registers.settingAddress
  settings.writeData    := registers.settingData
  settings.readAddress := VecInit(
    registers.settingAddress,
    NetworkSettings.ofNetwork(expected.address),
    NetworkSettings.ofNetwork(Mux(answers, arp.settingAddress, maker.settingAddress))
  )
  registers.setting := settings.readData(0)
  expected.setting  := settings.readData(1)
  arp.setting       := settings.readData(2)
  maker.setting     := settings.readData(2)

  registers.link             := link
  registers.counts.badFrames := badFrame && hears
  registers.counts.refused   := datagrams.refused
  registers.counts.dropped   := datagrams.dropped
  events.received            := datagrams.comes
  events.sent                := RegNext(maker.busy, false.B) && !maker.busy
  events.link                := RegNext(link, false.B) =/= link
}
