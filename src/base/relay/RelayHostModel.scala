package flyframe.relay

import flyframe.can.{CanBridgeModel, CanFiltersModel, CanFrame, CanMemoryModel}
import flyframe.params.CanParams
import flyframe.registers.{CanRegisters, RingRegisters}

/** The registers of a node in relay mode: those of the ring, and port F with its slots, filters and FIFO. */
class RelayHostModel(p: CanParams, node: RelayNodeModel) {
  private val prefix  = CanRegisters.Ports(0)
  private val start   = CanRegisters.PortStarts(0)
  private val slots0  = CanRegisters.SlotStarts(0)
  private val filter0 = CanRegisters.FilterStarts(0)
  private val registers =
    CanRegisters(0, p) ++ RingRegisters(addressBits = 7, hasRelay = true) ++ RingRegisters.relay
  private val memory = new CanMemoryModel(registers)

  private def inSlot(n: Int) =
    CanFrame.of(memory.bytes(slots0 + n * CanRegisters.FrameBytes, CanRegisters.FrameBytes))

  private def filterWords(entry: Int) = {
    val at = filter0 + entry * CanRegisters.FilterBytes
    def word(from: Int) = memory.byte(from) | memory.byte(from + 1) << 8 | memory.byte(from + 2) << 16 |
      memory.byte(from + 3) << 24
    (word(at), word(at + 4))
  }

  private val slots = new RelaySlotsModel(p.slots, inSlot)
  node.slots = slots
  node.filters = new CanFiltersModel(p.filters, filterWords)
  node.stamps = (slot, time) =>
    memory.put(slots0 + slot * CanRegisters.FrameBytes + TimeStamp, Seq(time & 0xff, time >> 8 & 0xff))

  for (r <- registers; f <- r.fields if f.reset != 0; a <- r.range)
    memory.write(a, memory.byte(a) | (f.reset << f.low >> 8 * (a - r.address) & 0xff).toInt)
  settings()

  /** Core cycles of a link bit. */
  def linkBit: Int = // RB-26
    memory.value("ring_link_bit").toInt max LinkTiming.least(p.coreClockMhz) min LinkTiming.Most

  private def TimeStamp = 6

  def write(address: Int, bytes: Seq[Int]): Unit =
    for ((byte, i) <- bytes.zipWithIndex; r <- memory.register(address + i))
      if (r.pdi.writable) writeByte(address + i, byte)

  private def writeByte(address: Int, byte: Int): Unit =
    if (address >= filter0) memory.writeFilter(address, byte)
    else if (address >= slots0) {
      val slot    = (address - slots0) / CanRegisters.FrameBytes
      val isStamp = Seq(TimeStamp, TimeStamp + 1).contains((address - slots0) % CanRegisters.FrameBytes)
      if (!slots.isPending(slot) && !isStamp) memory.write(address, byte)
    } else if (address >= start) port(address, byte)
    else {
      memory.write(address, byte)
      if (address == RingRegisters.Control && (byte >> RingRegisters.ClearConflict & 1) == 1) node.restart()
      settings()
    }

  private def port(address: Int, byte: Int): Unit = address - start match {
    case CanRegisters.Command =>
      if ((byte & 2) != 0) node.records.clear()
      if ((byte & 4) != 0) abort(0xffff)
    case CanRegisters.RxRelease => node.fifo.release()
    case at if at >= CanRegisters.Requests =>
      val map = byte << 8 * (at % 2)
      at & ~1 match {
        case CanRegisters.Requests => slots.request(map)
        case CanRegisters.Aborts   => abort(map)
        case CanRegisters.Sent     => slots.sent &= ~map
        case _                     => slots.failed &= ~map
      }
    case _ =>
      memory.write(address, byte)
      settings()
  }

  /** A frame of the other port (BR-01, BR-02). */
  def bridged(frame: CanFrame): Unit = new CanBridgeModel(slots, memory, slots0, node.records).take(frame)

  private def abort(map: Int): Unit = node.own.abort(slots.abort(map))

  private def settings(): Unit = {
    val wasOn = node.isOn
    node.address = memory.value("ring_address")
    node.isOn = memory.value("ring_relay") == 1
    node.confirm = memory.value("ring_confirm").toInt
    node.linkBit = linkBit
    node.retries = memory.value("ring_retries")
    node.life = memory.value("ring_life")
    node.isOneShot = memory.value(s"${prefix}_one_shot") == 1
    node.isBridge = memory.value(s"${prefix}_bridge") == 1
    if (node.isOn != wasOn) node.reset()
  }

  def read(address: Int, count: Int): Seq[Int] = (address until address + count).map { a =>
    if (a >= RingRegisters.Time && a < RingRegisters.Time + 4)
      node.time >> 8 * (a - RingRegisters.Time) & 0xff
    else if (a >= RingRegisters.Distances && a < RingRegisters.Distances + 256)
      node.sources.distance((a - RingRegisters.Distances) / 2, a % 2)
    else if (a == RingRegisters.LinkBit) linkBit // RB-26: as it counts
    else memory.register(a).fold(0)(memory.read(_, a, name => status(name)))
  }

  private def status(name: String): BigInt = name.stripPrefix(s"${prefix}_") match {
    case "ring_alone"     => flag(node.isAlone)
    case "ring_conflict"  => flag(node.isConflict)
    case "ring_mode"      => if (node.isUp(0) == node.isUp(1)) 1 else if (node.isUp(0)) 2 else 3
    case "ring_up1"       => flag(node.isUp(0))
    case "ring_up2"       => flag(node.isUp(1))
    case "rx_level"       => node.fifo.level
    case "pending"        => slots.pending
    case "sent"           => slots.sent
    case "failed"         => slots.failed
    case "bridge_dropped" => node.records.bridgeDropped
    case n if CanRegisters.CounterNames.contains(n) =>
      node.records.counter(CanRegisters.CounterNames.indexOf(n))
    case n if n.startsWith("rx_") && n != "rx_release" => received(name)
    case n                                             => BigInt(node.counters.named(n).getOrElse(0L))
  }

  private def flag(set: Boolean): BigInt = if (set) 1 else 0

  /** A field of the oldest frame received. */
  private def received(name: String): BigInt = {
    val f = rxFields(name)
    (node.fifo.oldest & f.mask) >> f.low
  }
  private lazy val rxFields =
    registers.find(_.address == start + CanRegisters.RxFrame).get.fields.map(f => f.name -> f).toMap
}
