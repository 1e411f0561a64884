package flyframe.frame

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.memory.{EcatAccess, ProtectedWrite, StampRequest, TableWrite}
import flyframe.mii.{Crc32, NibbleStream}
import flyframe.params.EscParams
import flyframe.protocol.{Command, DatagramLayout, Layout}
import flyframe.registers.{Access, ClockRegisters, FieldRecord, Register, RegisterMap}
import flyframe.syncmanager.AreaPort

/** What the registers and the loop control tell the frame processor.
  *
  * @param hasOffset
  *   commands may write to another place than they read from
  */
class FrameProcessorConfig(hasOffset: Boolean) extends Bundle {
  val stationAddress = UInt(16.W)
  val stationAlias   = UInt(16.W)
  val aliasEnable    = Bool()

  /** 0x0100[0]: destroy non-EtherCAT frames and set SOURCE_MAC[1] (FP-09, FP-10). */
  val destroyNonEtherCat = Bool()

  /** The loop of port 0 is closed by itself: the circulating-frame rule is active (LP-14). */
  val circulating = Bool()

  /** Event requests of this ESC that go into the IRQ field of every datagram (IRQ-08). */
  val ecatEvents = UInt(16.W)

  /** What commands that read and write add to the address for writing, where that is built (B-113). */
  val readWriteOffset = UInt((if (hasOffset) 16 else 0).W)
}

/** The ECAT processing unit: executes the datagrams of a passing frame on the fly, nibble by nibble.
  *
  * Every change is made in the nibble slot in which the nibble passes, so the unit delays the stream by one
  * register and no more: ADP and working counter travel least significant nibble first and are incremented by
  * one 4-bit adder; data are read ahead; the FCS is corrected by the CRC of the changes (B-13).
  *
  * @param p
  *   dataBusWidth and maxSubTelegrams are used
  * @param added
  *   registers beside those of the units
  */
class FrameProcessor(p: EscParams, added: Seq[Register] = Nil) extends Module {

  /** Once per nibble slot. */
  val step   = IO(Input(Bool()))
  val in     = IO(Input(new NibbleStream))
  val out    = IO(Output(new NibbleStream))
  val config = IO(Input(new FrameProcessorConfig(p.hasReadWriteOffset)))
  val memory = IO(new EcatAccess(p.lanes))

  private val registers    = RegisterMap(p, added)
  private val acknowledged = registers.filter(_.ecat == Access.ReadAcknowledge)

  /** By register whose reading acknowledges: the master has read a byte of it. That counts only if the frame
    * ends well.
    */
  val reads = IO(Output(FieldRecord.pulses(acknowledged.map(_.name))))

  /** A frame has ended, well or badly: a pulse behind the slot of its end, when its last data are in memory.
    * `busy` says that a frame is in the unit.
    */
  val frameGood = IO(Output(Bool()))
  val frameBad  = IO(Output(Bool()))
  val busy      = IO(Output(Bool()))

  /** A frame was in error, or had more datagrams than are processed: one pulse per frame (B-15, B-16). */
  val error = IO(Output(Bool()))

  private val parser = Module(new FrameParser)
  private val header = Module(new DatagramHeader(logical = p.fmmus > 0))

  /** FMMUs and SyncManagers, where they are built. */
  private val translated = Option.when(p.translates)(Module(new TranslatedAccess(p, registers, acknowledged)))
  private val access =
    translated.getOrElse(
      Module(new DataAccess(p.lanes, p.cyclesPerNibble, acknowledged, p.hasWriteProtection))
    )

  /** Where `out` lies in its frame. */
  val outPosition = IO(Output(new FramePosition))

  /** Register writes as they take effect, for the FMMUs. */
  val tableWrite = Option.when(p.translates)(IO(Input(new TableWrite)))
  val areas      = Option.when(p.syncManagers > 0)(IO(Flipped(new AreaPort(p))))

  /** The byte that is to be written, where that may be refused (SYS-02, SYS-03). */
  val protection = access.protection.map(_ => IO(new ProtectedWrite))

  /** What the frame asks of the receive times. */
  val stamps = Option.when(p.hasClocks)(IO(Output(new StampRequest)))

  /** The buffers of a good frame have changed hands. */
  val buffersSettled = Option.when(p.syncManagers > 0)(IO(Input(Bool())))
  translated.foreach { t =>
    t.tableWrite      := tableWrite.get
    t.readWriteOffset := config.readWriteOffset
    t.areas.foreach(_ <> areas.get)
  }

  private val position = parser.position
  private val active   = step && in.valid
  private val part     = position.part

  parser.step           := step
  parser.in             := in
  header.step           := step
  header.in             := in
  header.position       := position
  header.stationAddress := config.stationAddress
  header.stationAlias   := config.stationAlias
  header.aliasEnable    := config.aliasEnable
  access.step           := step
  access.in             := in
  access.position       := position
  access.request        := header.request
  header.advance        := access.advance
  memory <> access.memory
  for ((outside, byte) <- protection.zip(access.protection)) outside <> byte

  private val tooMany = position.datagram >= p.maxSubTelegrams.U
  access.enable := !tooMany
  reads         := access.reads

  // DC-07: BWR or FPWR. The byte is written before the command of the next datagram comes.
  for (s <- stamps) {
    val isCommand = active && on(DatagramLayout.Command) && !position.high
    s.written := memory.write && memory.writeMask(ClockRegisters.Trigger % p.lanes) &&
      memory.writeAddress / p.lanes.U === (ClockRegisters.Trigger / p.lanes).U
    s.ofPorts := RegEnable(in.data === Command.Bwr.U || in.data === Command.Fpwr.U, isCommand)
  }

  // 0x0100[0] as it was when the frame started (B-12).
  private val destroy = Reg(Bool())
  when(active && !in.payload) { destroy := config.destroyNonEtherCat }

  // Only for a nibble of the payload, which is looked at late: it comes through the choice of the port.
  private def on(where: Part.Type, bytes: Int*): Bool =
    part === where && bytes.map(position.byte === _.U).reduce(_ || _)
  private def on(field: Layout.Field): Bool = on(Part.header, field.offset to field.last: _*)

  // ADP + 1 and working counter + increment: one nibble adder with carry.
  private val carry = Reg(Bool())
  // Known since the command byte, long before they are needed.
  private val increments  = RegNext(header.request.incrementsAdp)
  private val readWrite   = RegNext(header.request.readWrite)
  private val inAdp       = on(DatagramLayout.Adp) && increments && !tooMany
  private val inCounter   = on(Part.counter, 0 until DatagramLayout.CounterBytes: _*)
  private val firstNibble = !position.high && !position.byte(0)
  private val increment = Mux(
    inCounter,
    access.readSuccess +& Mux(readWrite, access.writeSuccess << 1, access.writeSuccess),
    1.U(2.W)
  )
  private val sum = in.data +& Mux(firstNibble, increment, carry.asUInt)
  when(active) { carry := sum(4) }

  // IRQ field, nibble by nibble.
  private val irqNibble =
    Lanes.nibbles(config.ecatEvents, 4)(Cat(position.byte(0), position.high))

  private val lengthTop =
    on(
      Part.header,
      DatagramLayout.Length.last
    ) && position.high // bits 15:12 of the length word: M, C, two reserved
  private val circulate = lengthTop && config.circulating && !tooMany

  // The CRC of the changes made so far, this nibble excluded. Behind the last datagram it is added to the FCS
  // (B-13); it is zero from then on. The change of the last nibble is kept apart, so that a nibble need not
  // go through the CRC in its own cycle.
  private val changesBefore = Reg(UInt(32.W))
  private val lastChange    = Reg(UInt(4.W))
  private val changes       = Crc32.next(changesBefore, lastChange)
  private val atFcs         = part === Part.padding && position.frameBytes === 60.U

  private val data = WireDefault(in.data)
  when(in.payload) {
    when(on(Part.ethernet, 6) && !position.high && destroy) {
      data := in.data | 2.U // SOURCE_MAC[1]
    }.elsewhen(on(Part.ip, 26, 27)) {
      data := 0.U // UDP checksum (FP-05)
    }.elsewhen(inAdp || inCounter) {
      data := sum
    }.elsewhen(circulate) {
      data := in.data | 4.U
    }.elsewhen(on(DatagramLayout.Irq) && !tooMany) {
      data := in.data | irqNibble
    }.elsewhen(access.readMask.orR) {
      data := (access.readNibble & access.readMask) |
        (in.data & (~access.readMask | Fill(4, header.request.broadcast)))
    }.elsewhen(atFcs) {
      data := in.data ^ changes(3, 0)
    }
  }
  when(active) {
    changesBefore := Mux(in.payload, changes, 0.U)
    lastChange    := Mux(in.payload, in.data ^ data, 0.U)
  }

  // Verdict on the frame.
  private val isForeign = position.notEtherCat && destroy
  private val circled   = circulate && in.data(2)
  private val abort     = in.valid && in.payload && part =/= Part.ended && (isForeign || circled)
  private val aborted   = RegEnable(abort, false.B, step) // in the slot before; reset: no frame
  parser.abandon := abort
  // 4 to 68 whole bytes behind the last datagram.
  private val lengthGood =
    part === Part.padding && position.paddingBytes >= 4.U && position.paddingBytes <= 68.U
  private val mayEndHere = part === Part.foreign && !position.checksumCleared
  private val running    = part =/= Part.ended || !in.payload
  private val end        = aborted || (in.end && part =/= Part.ended)
  private val ends       = step && end
  private val bad        = aborted || in.bad || !(lengthGood || mayEndHere)
  private val hadTooMany = part === Part.padding && position.datagram > p.maxSubTelegrams.U

  // One cycle later, which nobody minds: counters and log are off the wire path.
  error     := RegNext(ends && (bad || hadTooMany), false.B)
  frameGood := RegNext(ends && !bad, false.B)
  frameBad  := RegNext(ends && bad, false.B)
  // Buffers change hands before registers are written (B-57).
  memory.commit := buffersSettled.getOrElse(if (p.translates) RegNext(frameGood, false.B) else frameGood)
  busy          := part =/= Part.ended

  // Control bits have a reset, so that nothing leaves before the first frame.
  private val output = RegInit(NibbleStream.idle)
  when(step) {
    output       := in
    output.valid := in.valid && running
    output.data  := data
    output.end   := end
    output.bad   := bad
    // What leaves has a right FCS if what came had one and all changes to it have cancelled out.
    output.crcGood := in.crcGood && !Mux(in.odd, changesBefore, changes).orR
  }
  out         := output
  outPosition := RegEnable(position, step)
}
