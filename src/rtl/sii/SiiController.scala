package flyframe.sii

import chisel3._
import chisel3.util._
import flyframe.memory.UnitWrite
import flyframe.params.EscParams
import flyframe.registers.{DlRegisters, SiiRegisters, StationRegisters}

/** The lines of the I2C EEPROM. */
class SiiPins extends Bundle {
  val scl_low  = Output(Bool())
  val sda_low  = Output(Bool())
  val sda      = Input(Bool())
  val two_byte = Input(Bool())
}

/** The configuration area's checksum: CRC-8, x^8 + x^2 + x + 1, from 0xFF, most significant bit first
  * (SII-01).
  */
object ConfigurationChecksum {
  val Start = 0xff

  def next(crc: UInt, byte: UInt): UInt =
    (7 to 0 by -1).foldLeft(crc) { (c, i) =>
      Mux(c(7) ^ byte(i), (c(6, 0) ## 0.U(1.W)) ^ 7.U, c(6, 0) ## 0.U(1.W))
    }
}

/** The lines of the I2C EEPROM, synchronous. */
class SiiLines extends Bundle {
  val twoByte = Input(Bool()) // strap, SII-16
  val sclLow  = Output(Bool())
  val sdaLow  = Output(Bool())
  val sda     = Input(Bool())
}

/** The SII EEPROM interface ([[SiiRegisters]], 0x0500 to 0x050F) and the loading of the configuration after
  * reset (SII-01 to SII-20).
  *
  * Bytes move one at a time between the EEPROM and the register RAM, so nothing is buffered here. The
  * configuration area is first read into scratch bytes of that RAM and copied to the registers when its
  * checksum is right.
  */
class SiiController(p: EscParams) extends Module {
  private object Code {
    val Clear  = 0
    val Read   = 1
    val Write  = 2
    val Reload = 4
  }

  /** The I2C EEPROM, if it is not emulated. */
  val lines = Option.when(p.hasI2c)(IO(new SiiLines))

  /** The write enable, the command are written; the host does it, and says that it has failed (SII-21). */
  val writeLow  = IO(Input(Valid(Bool())))
  val writeHigh = IO(Input(Valid(UInt(3.W))))
  val failure   = Option.when(p.hasEmulation)(IO(Input(Bool())))
  val byHost    = IO(Input(Bool()))

  /** Register writes are on their way: a command waits for the address that came behind it. */
  val registersBusy = IO(Input(Bool()))

  /** The next frame starts: ECAT's write enable ends (SII-12). */
  val frameStart = IO(Input(Bool()))

  /** 0x0500[1:0], 0x0501[0]. */
  val offered = IO(Input(Bool()))
  val forced  = IO(Input(Bool()))
  val taken   = IO(Input(Bool()))

  /** Present values of what a load changes only in part. */
  val enhancedLinkDetection = IO(Input(UInt(5.W))) // 0x0141[7:4], [1]
  val fifoSize              = IO(Input(UInt(3.W)))

  val write = IO(Decoupled(new UnitWrite))
  val read  = IO(Decoupled(UInt(12.W)))
  val data  = IO(Flipped(Valid(UInt(8.W))))

  /** Who may write 0x0502 to 0x0509. */
  val ecatMayWrite = IO(Output(Bool()))
  val pdiMayWrite  = IO(Output(Bool()))

  /** 0x0502 and 0x0503. */
  val writeEnable   = IO(Output(Bool()))
  val command       = IO(Output(UInt(3.W)))
  val checksumError = IO(Output(Bool()))
  val notLoaded     = IO(Output(Bool()))
  val commandError  = IO(Output(Bool()))
  val writeError    = IO(Output(Bool()))
  val busy          = IO(Output(Bool()))

  /** A command waits for the host to carry it out (SII-21). */
  val waits = IO(Output(Bool()))

  /** The last load found no configuration, for the ERR LED. */
  val loadFailed = IO(Output(Bool()))

  /** The first load is under way, for the RUN LED. */
  val loading = IO(Output(Bool()))

  private object State extends ChiselEnum {

    /** boot: waiting after reset; idle; settle: the rest of the frame is being written; address0 to 2: the
      * word address is fetched; start: START and control byte; high, low: address bytes; restart: repeated
      * START and control byte; in: bytes come; out: bytes go; put: a byte is stored; fetch: a byte to write
      * is fetched; stop; judge: a load is checked; copy, place: a configuration byte is fetched, stored.
      * Emulated: point: the address of a load is stored; serve: the host carries out the command; take: a
      * byte it has left is fetched.
      */
    val boot, idle, settle, address0, address1, address2, start, control, high, low, restart, controlRead, in,
        put, fetch, out, stop, judge, copy, place, point, serve, take = Value
  }
  import State._
  private val state = RegInit(boot)

  // Status, reset as the register table says: not loaded yet.
  private val enable   = RegInit(false.B)
  private val running  = RegInit(Code.Reload.U(3.W)) // command
  private val badSum   = RegInit(false.B)
  private val unloaded = RegInit(true.B)
  private val noAck    = RegInit(false.B)
  private val notMay   = RegInit(false.B)
  private val isFirst  = RegInit(true.B)             // the load after reset
  private val again    = RegInit(false.B)            // second try of a load
  private val lost     = RegInit(false.B)            // the last load failed

  private val byteAddress = Reg(UInt(19.W))
  private val count       = Reg(UInt(4.W))
  private val crc         = Reg(UInt(8.W))
  private val sumWord     = Reg(UInt(16.W))
  private val failed      = Reg(Bool())
  private val pending     = Reg(Bool())    // a command was given to the I2C master
  private val byte        = Reg(UInt(8.W))
  private val a5Middle    = Reg(UInt(4.W)) // A5[7:4]
  private val loads       = running === Code.Reload.U
  private val wait0       = RegInit(0.U(log2Ceil(p.coreClockMhz * p.siiStartUs + 1).W))

  private val ownedByPdi = offered || taken
  ecatMayWrite := !ownedByPdi && state === idle
  pdiMayWrite  := ownedByPdi && state === idle
  writeEnable  := enable || taken
  waits        := state === serve
  // A host that looks whether there is something to do must not see a command too early.
  command       := Mux(if (p.hasEmulation) waits else busy, running, 0.U)
  checksumError := badSum
  notLoaded     := unloaded
  commandError  := noAck
  writeError    := notMay
  busy          := state =/= idle
  loadFailed    := lost
  loading       := isFirst && state =/= idle

  when(frameStart) { enable := false.B }
  when(writeLow.valid && !byHost) { enable := writeLow.bits }

  // A command acts when its byte is written: byte 0x0502 with the write enable has come before.
  when(writeHigh.valid && state === idle) {
    val code  = writeHigh.bits
    val known = code === Code.Read.U || code === Code.Write.U || code === Code.Reload.U
    val may   = code =/= Code.Write.U || byHost || enable || (writeLow.valid && writeLow.bits)
    running := code
    when(code === Code.Clear.U || known) {
      noAck  := false.B
      notMay := false.B
    }
    when(known && may) {
      again := false.B
      count := 0.U
      state := settle
      when(code === Code.Reload.U) { byteAddress := 0.U }
    }
    when(known && !may) { notMay := true.B }
    when(!known && code =/= Code.Clear.U) { noAck := true.B }
  }

  private def fetchFrom(address: UInt, next: State.Type): Unit = {
    read.valid := !pending
    read.bits  := address
    when(read.fire) { pending := true.B }
    when(data.valid && pending) {
      pending := false.B
      byte    := data.bits
      state   := next
    }
  }
  private def store(address: UInt, value: UInt, next: State.Type): Unit = {
    write.valid        := true.B
    write.bits.address := address
    write.bits.data    := value
    when(write.fire) { state := next }
  }
  read.valid  := false.B
  read.bits   := 0.U
  write.valid := false.B
  write.bits  := 0.U.asTypeOf(new UnitWrite)

  private val lastByte = count === Mux(loads, 15.U, 7.U)
  // What is counted through is added to these by an OR.
  for (
    (name, address, bytes) <- Seq(
      ("Scratch", SiiRegisters.Scratch.start, 16),
      ("Data", SiiRegisters.Data, 8),
      ("Address", SiiRegisters.Address, 4)
    )
  )
    require(
      address % bytes == 0,
      f"SiiRegisters.$name is at 0x$address%04x but must be at a multiple of $bytes."
    )
  private val scratch = SiiRegisters.Scratch.start
  private val first   = if (p.hasI2c) start else point // of a load

  switch(state) {
    is(boot) {
      wait0       := wait0 + 1.U
      pending     := false.B
      byteAddress := 0.U
      count       := 0.U
      when(wait0 === (p.coreClockMhz * p.siiStartUs).U) { state := first }
    }
    is(settle) { when(!registersBusy) { state := Mux(loads, first, if (p.hasI2c) address0 else serve) } }
    is(put) {
      store(
        Mux(loads, scratch.U | count, SiiRegisters.Data.U | count),
        byte,
        if (p.hasI2c) Mux(lastByte, stop, in) else take
      )
      when(write.fire) {
        count := count + 1.U
        when(count < 14.U) { crc := ConfigurationChecksum.next(crc, byte) }
        when(count >= 14.U) { sumWord := Cat(byte, sumWord(15, 8)) }
        if (p.hasEmulation) when(count(2, 0).andR) { state := Mux(count(3), judge, point) }
      }
    }
    is(judge) {
      val right = !failed && (sumWord(7, 0) === crc || sumWord === 0x88a4.U) // SII-03
      count := 0.U
      when(right) {
        state := copy
      }.elsewhen(!again) { // SII-06: one more try
        again := true.B
        state := first
      }.otherwise {
        when(failed) { noAck := true.B }.otherwise { badSum := true.B }
        isFirst := false.B
        lost    := true.B
        state   := idle
      }
    }
    is(copy) { fetchFrom(scratch.U | count, place) }
    is(place) {
      // Word 2 belongs to distributed clocks; the alias and some bits only count at the first load (SII-08).
      val target = MuxLookup(count, 0.U(12.W))(
        Seq(
          0  -> SiiRegisters.PdiControl,
          1  -> SiiRegisters.ConfigurationA0,
          2  -> SiiRegisters.PdiConfiguration,
          3  -> (SiiRegisters.PdiConfiguration + 1),
          6  -> SiiRegisters.PdiConfigurationExt,
          7  -> (SiiRegisters.PdiConfigurationExt + 1),
          8  -> StationRegisters.Alias,
          9  -> (StationRegisters.Alias + 1),
          10 -> SiiRegisters.ConfigurationA5,
          11 -> (SiiRegisters.ConfigurationA5 + 1),
          12 -> SiiRegisters.ConfigurationA6,
          13 -> DlRegisters.FifoByte
        ).map { case (i, a) => i.U -> a.U(12.W) }
      )
      val value = MuxLookup(count, byte)(
        Seq(
          1.U -> Mux(
            isFirst,
            byte,
            Cat(enhancedLinkDetection(4, 1), byte(3, 2), enhancedLinkDetection(0), byte(0))
          ),
          13.U -> Cat(a5Middle, 0.U(1.W), sumWord(2, 0))
        )
      )
      val skip = target === 0.U || ((count === 8.U || count === 9.U) && !isFirst)
      val next = Mux(count === 13.U, idle, copy)
      when(skip) { state := next }.otherwise { store(target, value, next) }
      when(skip || write.fire) {
        count := count + 1.U
        when(count === 10.U) { a5Middle := byte(7, 4) }
        // From here on the checksum is not needed any more: its place keeps the new RX FIFO size.
        when(count === 11.U) { sumWord := Mux(isFirst, ~byte(3, 1), fifoSize) }
        when(count === 13.U) {
          isFirst  := false.B
          unloaded := false.B
          badSum   := false.B
          lost     := false.B
        }
      }
    }
  }

  if (p.hasI2c) i2cEeprom() else emulation()

  /** The host is the EEPROM: it answers commands with what it writes to 0x0508 and then to 0x0503 (SII-21 to
    * SII-24). A load takes it twice, for words 0 and 4.
    */
  private def emulation(): Unit = switch(state) {
    is(point) {
      // count(3): the second half; count(1, 0): byte of the address.
      crc := Mux(count(3), crc, ConfigurationChecksum.Start.U)
      store(SiiRegisters.Address.U | count(1, 0), Mux(count(1, 0) === 0.U && count(3), 4.U, 0.U), point)
      when(write.fire) {
        count := count + 1.U
        when(count(1, 0).andR) {
          count := count & 8.U
          state := serve
        }
      }
    }
    is(serve) {
      when(writeHigh.valid && byHost && writeHigh.bits === running) {
        failed := failure.get
        state  := Mux(!loads, idle, Mux(failure.get, judge, take))
        when(!loads && failure.get) { noAck := true.B }
      }
    }
    is(take) { fetchFrom(SiiRegisters.Data.U | count(2, 0), put) }
  }

  /** The I2C master: one command per state, some with a byte (SII-18, SII-19). */
  private def i2cEeprom(): Unit = {
    // Rounded up: the clock may be slower than asked for, never faster.
    val i2c = Module(new I2cMaster((p.coreClockMhz * 1000 + 4 * p.siiClockKhz - 1) / (4 * p.siiClockKhz)))
    i2c.suggestName("i2c")
    i2c.sda          := lines.get.sda
    lines.get.sclLow := i2c.sclLow
    lines.get.sdaLow := i2c.sdaLow

    val asks     = WireDefault(false.B)
    val what     = WireDefault(I2cCommand.write)
    val give     = WireDefault(0.U(8.W))
    val finished = pending && i2c.done
    i2c.command.valid := asks && !pending
    i2c.command.bits  := what
    i2c.data          := give
    when(i2c.command.fire) { pending := true.B }
    when(finished) { pending := false.B }

    /** Do `command`, then go to `next`; a byte that is not acknowledged ends the transfer. */
    def transfer(command: I2cCommand.Type, next: State.Type, value: UInt = 0.U): Unit = {
      asks := true.B
      what := command
      give := value
      when(finished) {
        state := next
        when((command === I2cCommand.write) && !i2c.acknowledged) {
          failed := true.B
          state  := stop
        }
      }
    }
    val twoByte     = lines.get.twoByte
    val highBits    = Mux(twoByte, byteAddress(18, 16), byteAddress(10, 8))
    val controlByte = Cat("b1010".U(4.W), highBits, 0.U(1.W))

    switch(state) {
      is(address0) {
        fetchFrom(SiiRegisters.Address.U, address1)
      }
      is(address1) {
        byteAddress := byte << 1
        fetchFrom((SiiRegisters.Address + 1).U, address2)
      }
      is(address2) {
        byteAddress := Cat(byte, byteAddress(8, 0))
        fetchFrom((SiiRegisters.Address + 2).U, start)
      }
      is(start) {
        when(!loads) { byteAddress := Cat(byte(1, 0), byteAddress(16, 0)) }
        count  := 0.U
        failed := false.B
        crc    := ConfigurationChecksum.Start.U
        transfer(I2cCommand.start, control)
      }
      is(control) { transfer(I2cCommand.write, Mux(twoByte, high, low), controlByte) }
      is(high) { transfer(I2cCommand.write, low, byteAddress(15, 8)) }
      is(low) { transfer(I2cCommand.write, Mux(running === Code.Write.U, fetch, restart), byteAddress(7, 0)) }
      is(restart) { transfer(I2cCommand.start, controlRead) }
      is(controlRead) { transfer(I2cCommand.write, in, controlByte | 1.U) }
      is(in) {
        transfer(Mux(lastByte, I2cCommand.readLast, I2cCommand.read), put)
        when(finished) {
          byte := i2c.received
        }
      }
      is(fetch) { fetchFrom(SiiRegisters.Data.U | count, out) }
      is(out) {
        transfer(I2cCommand.write, Mux(count(0), stop, fetch), byte)
        when(finished) { count := count + 1.U }
      }
      is(stop) {
        asks := true.B
        what := I2cCommand.stop
        when(finished) { state := Mux(loads, judge, idle) }
        when(finished && !loads && failed) { noAck := true.B }
      }
    }
  }
}
