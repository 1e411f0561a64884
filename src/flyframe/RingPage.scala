package flyframe

import flyframe.can.BitSetting
import flyframe.fibre.Reach
import flyframe.params.{EscParams, Presets}
import flyframe.relay.LinkTiming
import flyframe.registers.{CanRegisters, NodeRegisters, PlantRegisters, Register, RegisterMap, RingRegisters}

/** `docs/ring.md`: how to plan a ring, set up its nodes, and read where it is broken. Reach, bit timing and
  * addresses are those of the sources.
  */
object RingPage {
  private val preset    = Presets.ring
  private val registers = RegisterMap(Presets.relay)
  private val f         = CanRegisters.PortStarts.head

  /** Quanta of a bit: the propagation and both phase segments of FR-38. */
  val timing: BitSetting = BitSetting(tseg1 = 18 + 3, tseg2 = 3, sjw = 3)

  /** The upper two of the four bytes of the bit timing, the first one below. */
  val timingBytes: Int = timing.tseg1 - 1 | (timing.tseg2 - 1 | timing.sjw - 1 << 4) << 8

  /** Core cycles of a quantum at a bit rate of bus mode, kbit/s. */
  def prescaler(coreClockMhz: Int, kbps: Int): Int = {
    val prescaler = coreClockMhz * 1000 / (timing.length * kbps)
    require(
      prescaler * timing.length * kbps == coreClockMhz * 1000,
      s"rate is $kbps kbit/s but must divide $coreClockMhz MHz by ${timing.length} quanta."
    )
    prescaler
  }

  /** Core cycles of the shortest bit of a link, by the core clock. */
  private val leastAt50  = LinkTiming.least(50)
  private val leastAt100 = LinkTiming.least(100)

  private def at(address: Int): String = f"`0x$address%04X`"

  /** The address of a field, with its bits. */
  private def bits(field: String): String = {
    val r = registers.find(_.fields.exists(_.name == field)).get
    val b = r.fields.find(_.name == field).get
    s"${at(r.address)}[${if (b.width == 1) s"${b.low}" else s"${b.high}:${b.low}"}]"
  }

  private def mask(field: String): Int =
    registers.flatMap(_.fields).find(_.name == field).get.mask.toInt

  private def counter(address: Int): Register = registers.find(_.address == address).get

  private def named(name: String): String = at(registers.find(_.name == name).get.address)

  private def reach(coreClockMhz: Int): Seq[String] = {
    val header = Seq("kbit/s") ++ Reach.Nodes.map(n => s"$n nodes") ++ Seq(s"prescaler, $coreClockMhz MHz")
    val rows = Reach.Rates.map { rate =>
      val entries = Reach.Nodes.map(n => Reach.entry(rate, n, coreClockMhz))
      Seq(s"$rate") ++ entries ++ Seq(s"${prescaler(coreClockMhz, rate)}")
    }
    table(header: _*)(rows)
  }

  private def setup: Seq[(String, String)] = {
    val low = timingBytes
    Seq(
      s"${at(RingRegisters.Address)}" -> "the node's address, each another one",
      s"${at(RingRegisters.Control)}" ->
        s"${1 << RingRegisters.Home} in one node, normally the one with the server: it is `home`; else 0",
      s"${at(f + CanRegisters.Timing)}, four bytes" ->
        (f"two bytes with the prescaler less one, then 0x${low & 0xff}%02X 0x${low >> 8}%02X: " +
          s"${timing.length} quanta"),
      s"${at(CanRegisters.FilterStarts.head)} on" ->
        ("what the node wants to receive; value 0x20000000 and mask 0 let everything pass. The first " +
          "filter that matches counts: what one of 0 to 7 takes, no bridge takes"),
      s"${at(f + CanRegisters.Control)}" ->
        (f"0x${mask("can_f_run") | mask("can_f_recover_itself")}%02X: it takes part, after eleven " +
          "recessive bits, and comes back from bus-off by itself")
    )
  }

  private val modes = Seq(
    Seq("Length", "limited by the bit rate, below", "100 km, and more with a longer `ring_confirm`"),
    Seq("Nodes", "limited by the bit rate, below", "up to 125"),
    Seq(
      "A break",
      "heals within the first frame behind it",
      "loses nothing, and delays by `ring_confirm` at most"
    ),
    Seq("Sent means", "somebody has acknowledged it", "all that can be reached have seen it"),
    Seq("Beside others", "any CAN controller behind a modem", "nodes of this kind only")
  )

  private def relaySetup: Seq[(String, String)] = Seq(
    s"${at(RingRegisters.Address)}" -> "the node's address, each another one, 1 to 125",
    s"${at(RingRegisters.LinkBit)}, two bytes" ->
      "core cycles of a bit, the same time everywhere; out of reset 2 Mbit/s",
    s"${at(RingRegisters.Confirm)}, two bytes" ->
      s"time until a frame is repeated in 10 us; ${RingRegisters.ConfirmReset} out of reset",
    s"${at(RingRegisters.Retries)}" ->
      s"repeats until a frame has failed; ${RingRegisters.RetriesReset} out of reset",
    s"${at(RingRegisters.Life)}" -> "number of this start, modulo 128, from memory that keeps it",
    s"${at(CanRegisters.FilterStarts.head)} on" -> "what the node wants to receive, as above",
    s"${at(RingRegisters.Control)}" ->
      s"${1 << RingRegisters.Relay}: relay mode; it listens, tells its life, and sends what is requested"
  )

  /** What a node shows, and where the ring is broken then. */
  private val signs = Seq(
    Seq("1", "no", "both up", "nothing is wrong here; the ring is open or broken at other nodes"),
    Seq("2", "yes", "both up", "the ring is whole, and open here: at `home`, or where a break was mended"),
    Seq("2", "no", "port 2 down", "broken between port 2 of this node and port 1 of the next"),
    Seq("3", "no", "port 1 down", "broken between port 1 of this node and port 2 of the one before"),
    Seq("1", "no", "both down", "alone: broken on both sides, or the only node with power")
  )

  /** Why a node may be silent. */
  private def silences = Seq(
    Seq(
      s"${bits("ring_conflict")} set",
      "another node has its address (FR-62): give it another one, then " +
        s"write ${1 << RingRegisters.ClearConflict} to ${at(RingRegisters.Control)} beside what stands there"
    ),
    Seq(
      s"a port down, ${bits("ring_stuck1")} (port 2: ${bits("ring_stuck2")}) set",
      "light that stays dominant: a neighbour that is stuck"
    ),
    Seq(
      s"a port down, ${bits("ring_signal1")} (${bits("ring_signal2")}) clear, and not stuck",
      "no light: a fibre, a module, or a neighbour without power; or noise, if " +
        s"${at(RingRegisters.Noise1)} (${at(RingRegisters.Noise2)}) counts"
    ),
    Seq(
      s"a port down, ${bits("ring_search1")} (${bits("ring_search2")}) set",
      "the neighbour sends search: it does not hear this node, or has gone down three times within a " +
        "second and waits for one (FR-14)"
    ),
    Seq(
      "a port down with light and without search",
      "`ring_up_ms` is not over, or it has gone down three times within a second and waits for one (FR-14)"
    ),
    Seq(s"${bits("ring_off")} set", "its ports are switched off"),
    Seq(
      s"${bits("can_f_state")} = 0 in bus mode",
      s"its CAN controller is stopped; with ${bits("can_f_impossible")} set its bit timing is impossible"
    ),
    Seq(
      s"${bits("can_f_state")} = 3",
      s"bus-off: write ${mask("can_f_recover")} to ${at(f + CanRegisters.Command)}, " +
        s"or set ${bits("can_f_recover_itself")} from the beginning"
    ),
    Seq(
      s"${bits("ring_cut_off")} set",
      "it drove dominant for too long, and is cut off until it stops (FR-37)"
    )
  )

  /** A paragraph, in lines as they are everywhere here. */
  private def paragraph(text: String): Seq[String] = {
    val lines = text.split("\\s+").foldLeft(Vector("")) { (lines, word) =>
      val longer = s"${lines.last} $word".trim
      if (longer.length <= 110) lines.init :+ longer else lines :+ word
    }
    lines :+ ""
  }

  private def table(header: String*)(rows: Seq[Seq[String]]): Seq[String] =
    (header +: header.map(_ => "---") +: rows).map(_.mkString("| ", " | ", " |")) :+ ""

  private def counters = Seq(
    RingRegisters.Losses1  -> "a link that comes and goes",
    RingRegisters.Losses2  -> "the same at port 2",
    RingRegisters.Noise1   -> "a receiver without light, or one that is overdriven",
    RingRegisters.Noise2   -> "the same at port 2",
    RingRegisters.Closings -> "breaks elsewhere: this node, as guard, has joined the two pieces",
    RingRegisters.Latches  -> "a ring that was closed; it is normal once when a ring without `home` starts"
  )

  private def relayCounters = RingRegisters.relay
    .filter(r => RingRegisters.RelayCounterNames.contains(r.name))
    .map(r => Seq(s"${at(r.address)} `${r.name}`", r.title))

  /** The page. */
  def text: String = Seq(
    Seq("# The fibre ring", ""),
    Seq("Generated from `src/flyframe/RingPage.scala` by `make generated`; do not edit.", ""),
    paragraph(
      s"""How to plan a ring of nodes of preset `${preset.preset}` or `${Presets.relay.preset}`, set them up,
      and read where a fibre is cut. What a node does in each case, rule by rule:
      [rules/fibre.md](rules/fibre.md), and for relay mode [rules/relay.md](rules/relay.md)."""
    ),
    Seq("## Which mode", ""),
    table("", "Bus mode", "Relay mode")(modes),
    paragraph("All nodes of a ring have the same mode."),
    Seq("## Wiring", ""),
    paragraph(s"""Optical port 2 of a node goes to port 1 of the next, with a fibre for each direction, and
    that
      of the last one to port 1 of the first. The pins take and give a square wave, light or no light: any
      pair of modules that passes ${preset.toneRecessiveKhz / 1000} to ${preset.toneDominantKhz / 1000} MHz
      with a duty cycle of 40 to 60 %, jitter of 2 ns at most (FR-05), and no more delay than the tables below
      count, will do. A ring that is never closed is a line, and works as one."""),
    paragraph("""A board with pins, PLL, host bus and constraints for each kind of node, as Quartus project:
    [fpga/README.md](../fpga/README.md#the-ring-board)."""),
    Seq("## How long, how fast: bus mode", ""),
    paragraph(
      s"""In bus mode the ring is one CAN bus: a bit must reach the farthest node and come back before it
      is sampled. Light needs ${Reach.NsPerMetre} us for a kilometre; each node and its two modules (40 ns of
      it) need ${Reach.nodeNs(100) / 1000.0} us (${Reach.nodeNs(
          50
        ) / 1000.0} us at a core clock of 50 MHz). The greatest
      length of the whole ring in km, gap included, as a break may move the gap anywhere (FR-38); for other
      rings `make ring-plan NODES=20 METRES=600` tells bit rate, bit timing and delays of both modes:"""
    ),
    reach(100),
    Seq("The same at a core clock of 50 MHz, and of a ring with nodes of both clocks:", ""),
    reach(50),
    paragraph(
      s"""With this bit timing (${timing.length} quanta, sample point behind
      ${1 + timing.tseg1}, SJW ${timing.sjw}) the clocks of
      the nodes may be 4,000 ppm off the nominal one."""
    ),
    paragraph("""![Length against bit rate for 2 to 50 nodes: lines by this rule, points as far as the
      farthest two nodes of the golden model arbitrate](ring-reach.svg)"""),
    paragraph(
      """How far beyond the rule it goes depends on where edges fall; do not plan with it. What light the
      receivers take, for the demodulator `demodulator` 0 (fast) and the published one (1, counting), which
      decides every 2 us only (FR-08). So it cannot do 400 kbit/s, which rules out relay mode, and the tables
      above do not hold for it; nor do they for slower tones (`toneDominantKhz`), which take longer to be
      heard (FR-04):"""
    ),
    paragraph("""![Wrong symbols against jitter, duty cycle, lost pulses and clock
      error](ring-modem.svg)"""),
    Seq("## How long, how fast: relay mode", ""),
    paragraph(
      s"""A link has 400 kbit/s to 2 Mbit/s, the same everywhere: $leastAt50 core cycles a bit ($leastAt100 at
      100 MHz) to ${LinkTiming.Most}. Each node delays a frame by up to 60 bits if its output is idle
      (FR-46), each kilometre by ${Reach.NsPerMetre} us. A frame may pass 255 nodes. `ring_confirm` must be
      longer than the way round a loaded ring: 10 ms at 2 Mbit/s, 20 ms at 1 Mbit/s and 50 ms at 400 kbit/s
      do for 50 nodes and 100 km, there and back in a broken one. It needs more with more nodes: there and
      back is up to 120 bits for each, and what waits on the way comes to that. It is too short where
      `ring_repeated` (${named("ring_repeated")}) counts in a ring that is whole, or in one of which a fibre
      is pulled to see that. The clocks of all nodes lie within 1,000 ppm of one another (RB-07)."""
    ),
    paragraph(
      f"""How long a frame of 8 bytes takes until the last node has it, in a ring of 51 nodes, 10 km
      and 2 Mbit/s in which random nodes send ([figures](ring-load.csv)); 100 %% are
      ${LinkTiming.FullLoad}%,d frames a second of all together. What a whole and a broken ring carry for
      long when all nodes send what they can: [report](ring-report.md#goals)."""
    ),
    paragraph("![Milliseconds to the last node against load, of a whole and a broken ring](ring-load.svg)"),
    paragraph("What passes on a link, and how it begins as light:"),
    paragraph("![Fields, stuff bits and levels of a frame](ring-frame.svg)"),
    paragraph("![The first bits of it as tones](ring-tones.svg)"),
    Seq("## Setting up a node: bus mode", ""),
    table("Register", "Write")(setup.map { case (where, what) => Seq(where, what) }),
    paragraph("""One node is `home`, so that it is known where the ring is open. Without it the nodes find
    one by
      themselves (FR-36), and nothing else is different, but that frames may be missed by the nodes of one
      piece
      when a break heals (FB-11)."""),
    paragraph(s"""A port comes up when it has heard its neighbour for `ring_up_ms` (${at(RingRegisters.UpMs)},
      ${RingRegisters.UpMsReset} out of reset), the same time in all nodes. A port that waits already does so
      for the time that was written before: switch the ports off (`ring_off`, ${bits("ring_off")}) while it is
      changed."""),
    Seq("## Setting up a node: relay mode", ""),
    table("Register", "Write")(relaySetup.map { case (where, what) => Seq(where, what) }),
    paragraph(
      s"""Nobody is guard or `home`. What a slot holds has been confirmed when the slot is *sent*
      (${at(f + CanRegisters.Sent)}): every node that can be reached has seen it. The node repeats it until
      then, after longer and longer times; behind `ring_retries` repeats the slot is *failed*
      (${at(f + CanRegisters.Failed)})."""
    ),
    Seq("## The program of a node", ""),
    paragraph("""`src/firmware` has it in portable C99. A node's host is compiled of `ring/*.c`,
      `driver/registers.c`, `start_number.c`, `node/can_port.c` and `node/ring_node.c`, with `generated` among
      the folders of headers (`ring-node-tp.h`, whichever preset it is); its main loop is in
      [ring_node.h](../src/firmware/node/ring_node.h). The host of `ring-server` takes also `ascon.c` and of
      `node` `plant_port.c`, `ring_conflict.c`, `ring_picture.c`, `ring_reports.c` and `ring_server.c`. The
      host of `ring-gateway` takes also `node/ring_conflict.c`, `node/ring_picture.c`, `node/ring_gateway.c`,
      all of `driver` and `slave`, and `generated/ring-gateway.objects.c`, with `src/firmware/slave` among the
      folders of headers. The board supplies `board_read` and `board_write` (`driver/transport.h`), and of
      `port.h` `board_load`, `board_store`, `board_random`, `board_time`, `board_wait` and
      `board_watchdog`."""),
    Seq("## A bridge to a twisted pair", ""),
    paragraph(
      s"""Preset `ring-node-tp` has a second CAN controller, for a twisted pair, and a bridge: buses of up
      to 1 Mbit/s at places of the ring kilometres apart. What filters 8 to 15 of a port accept goes to slots
      8 to 15 of the other one (the first filter that matches counts: a frame that one of 0 to 7 takes stays
      here), if bit 6 of its control says so (${at(CanRegisters.PortStarts(0))},
      ${at(CanRegisters.PortStarts(1))}); the host keeps slots 0 to 7. The bridge acknowledges for the other
      side: frames that find no slot are dropped, the last in CAN order first, and counted
      (${CanRegisters.PortStarts.map(s => at(s + CanRegisters.BridgeDropped)).mkString(", ")}). Never let two
      bridges join the same two buses: their frames would go round for ever."""
    ),
    Seq("## A ring under a server", ""),
    paragraph(
      s"""Preset `ring-server` is node 1 of a ring, at 50 MHz, with a PHY for the plant network (port 0; MII,
      or RMII by `rmiiPorts`). Its registers from ${at(PlantRegisters.Control)} on hold the addresses of both
      ends; the host writes a datagram from ${at(PlantRegisters.SendData)} on and reads one of the server from
      ${at(PlantRegisters.ReceivedData)} on; frames, checksums and ARP are the controller's. The host program
      [ring_server](../src/firmware/node/ring_server.h) does the rest: messages to node 1 go to the server,
      those of the server to nodes, and the [page](server.md#rings) shows the ring. Give its host a memory for
      the number of its starts, a source of random numbers, and the key that the server has."""
    ),
    Seq("## A ring under an EtherCAT master", ""),
    paragraph(
      s"""Preset `ring-gateway` is preset `slave` with four SyncManagers and a node in it: bit 15 of an
      address at the host port is that of the ring, whose registers begin at ${at(EscParams.RingSpace)} and
      whose events have a pin of their own, `ring_irq`. Process data of nodes are inputs of the master, its
      outputs process data of nodes (GW-02). Which object is in which slot stands in the [device
      file](device.md), and in objects 0x8010 (inputs) and 0x8020 (outputs), which a master may write in
      PREOP: 256 × node + object, 0 for none. The host program
      [ring_gateway](../src/firmware/node/ring_gateway.h) does the rest. Where the ring is broken, who is
      there, and whether another node has the gateway's address are inputs, too; without OP, without outputs
      in time, or without bit 0 of the control byte the nodes are told that there is no valid value."""
    ),
    Seq("## Reading a break", ""),
    paragraph(s"""The mode stands in ${bits("ring_mode")}, the guard in ${bits("ring_guard")}, the ports in
      ${at(RingRegisters.Ports)}: up are those with ${bits("ring_up1")} and ${bits(
        "ring_up2"
      )}. A change is an
      event (${bits("ring_event_port")}, ${bits("ring_event_mode")}) that may interrupt the host
      (${at(NodeRegisters.Mask)})."""),
    table("Mode", "Guard", "Ports", "Where")(signs),
    paragraph(
      s"""In relay mode the same holds without guards, and from ${at(RingRegisters.Distances)} on a node
      has the hops to each address by either port (FR-60): of nodes behind a break one of the two is
      not heard any more."""
    ),
    paragraph("A node that is silent though its fibres are whole:"),
    table("Sign", "Means")(silences),
    paragraph("""A cut of one fibre takes both ends of its link down, so that both neighbours show it. What a
      node has heard wrong tells more. Counters of a byte stop at 255, those of four bytes go round; they
      begin anew with a reset only. A host that reads four bytes in parts reads the upper ones, the lower
      ones, and the upper ones again; if these are not the same now, it does so once more:"""),
    table("Counter", "Tells of")(counters.map { case (address, tells) =>
      Seq(s"${at(address)} `${counter(address).name}`", tells)
    }),
    table("Counter of relay mode", "Tells of")(relayCounters),
    paragraph(
      """In bus mode, within the first frame behind a break the guard joins the two pieces; that frame and
      one more
      may be sent again, by CAN's own means. When the fibre is mended the ring stays open there, and
      nothing is
      disturbed. A second break leaves two pieces, each a working bus. Here timers are shorter than out of
      reset:"""
    ),
    paragraph(
      "![Tones, modes, levels, frames and messages around a break in bus mode](ring-break-bus.svg)"
    ),
    paragraph("""In relay mode frames go both ways round, so that only what was being sent into the cable has
      to be repeated, by the node that sends; what had passed it has come by the other way:"""),
    paragraph("![Tones, modes, frames and messages around a break in relay mode](ring-break-relay.svg)")
  ).flatten.dropRight(1).mkString("", "\n", "\n")
}
