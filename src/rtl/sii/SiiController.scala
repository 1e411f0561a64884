package flyframe.sii

import chisel3._
import chisel3.util._
import flyframe.memory.UnitWrite
import flyframe.params.EscParams
import flyframe.registers.{RegisterMap, RegisterNames, SiiRegisters}

/** The pins of the I2C EEPROM: 1 at `scl_low` or `sda_low` pulls that line low, `sda` is the level of the
  * data line, and `two_byte` is the strap that says how many address bytes the EEPROM has (SII-16).
  */
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

/** The same pins behind their clock crossings, in the core clock. */
class SiiLines extends Bundle {
  val twoByte = Input(Bool())
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

  /** Writes of 0x0502 and 0x0503: `writeLow` is bit 0, ECAT's write enable, and `writeHigh` is the command.
    * `byHost` says that the host writes them, else a frame does. By `failure`, bit 13, a host that emulates
    * the EEPROM says that it could not carry out the command (SII-21).
    */
  val writeLow  = IO(Input(Valid(Bool())))
  val writeHigh = IO(Input(Valid(UInt(3.W))))
  val failure   = Option.when(p.hasEmulation)(IO(Input(Bool())))
  val byHost    = IO(Input(Bool()))

  /** Register writes of a frame are still being carried out. A command comes before the address in the
    * frame's order of bytes, so it must wait until these are done.
    */
  val registersBusy = IO(Input(Bool()))

  /** The next frame starts. ECAT's write enable holds for one frame only and ends here (SII-12). */
  val frameStart = IO(Input(Bool()))

  /** Who has the interface (SII-10, SII-11): 0x0500[0], ECAT offers it to the PDI; 0x0500[1], ECAT takes it
    * back by force; 0x0501[0], the PDI has taken it.
    */
  val offered = IO(Input(Bool()))
  val forced  = IO(Input(Bool()))
  val taken   = IO(Input(Bool()))

  /** Present values of registers of which a reload changes only a part: the rest is written as it was. */
  val enhancedLinkDetection = IO(Input(UInt(5.W))) // 0x0141[7:4], [1]
  val fifoSize              = IO(Input(UInt(3.W)))

  /** Writes of bytes to registers and register RAM, reads of bytes from there, and the bytes that come back.
    */
  val write = IO(Decoupled(new UnitWrite))
  val read  = IO(Decoupled(UInt(12.W)))
  val data  = IO(Flipped(Valid(UInt(8.W))))

  /** Which side may write 0x0502 to 0x0509 now: the one that has the interface, while no command runs. */
  val ecatMayWrite = IO(Output(Bool()))
  val pdiMayWrite  = IO(Output(Bool()))

  /** The fields of 0x0502 and 0x0503, as the register table names them. */
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

    /** How far a command or a load is. These are for both kinds of EEPROM:
      *   - `boot`: the EEPROM gets time to start after reset.
      *   - `idle`: no command runs.
      *   - `settle`: the command waits until the register writes of its frame are done.
      *   - `put`: a byte that came from the EEPROM is stored in the register RAM.
      *   - `judge`: a load has come as a whole, and its checksum is checked.
      *   - `copy`, `place`: a byte of a good load is fetched from the scratch bytes, and written to its
      *     register.
      *
      * These are for an I2C EEPROM:
      *   - `address0`, `address1`, `address2`: the three bytes of the word address are fetched.
      *   - `start`, `control`: a START is sent, and the control byte for writing.
      *   - `high`, `low`: the bytes of the EEPROM's address are sent.
      *   - `restart`, `controlRead`: a repeated START is sent, and the control byte for reading.
      *   - `in`: a byte is received.
      *   - `fetch`, `out`: a byte to be written is fetched from the register RAM, and sent.
      *   - `stop`: a STOP is sent.
      *
      * These are for an EEPROM that the host emulates:
      *   - `point`: the address of a load is stored where the host looks for it.
      *   - `serve`: the host carries out the command.
      *   - `take`: a byte that the host has left is fetched.
      */
    val boot, idle, settle, address0, address1, address2, start, control, high, low, restart, controlRead, in,
        put, fetch, out, stop, judge, copy, place, point, serve, take = Value
  }
  import State._
  private val state = RegInit(boot) // reset: the first load is to come

  // What the status register shows, and what is known of the load. The reset values are those of the register
  // table: nothing is loaded yet, and the command that runs is the first load.
  private val enable   = RegInit(false.B)            // ECAT may write in this frame
  private val running  = RegInit(Code.Reload.U(3.W)) // the command that runs
  private val badSum   = RegInit(false.B)            // the last load had a wrong checksum
  private val unloaded = RegInit(true.B)             // no load has succeeded
  private val noAck    = RegInit(false.B)            // the command is invalid, or was not acknowledged
  private val notMay   = RegInit(false.B)            // the command was a write without write enable
  private val isFirst  = RegInit(true.B)             // the load is the one after reset
  private val again    = RegInit(false.B)            // the load is tried for the second time
  private val lost     = RegInit(false.B)            // the last load failed

  private val byteAddress = Reg(UInt(19.W)) // address in the EEPROM, in bytes
  private val count       = Reg(UInt(4.W))  // number of the byte of the transfer or the load
  private val crc         = Reg(UInt(8.W))  // checksum of the bytes of a load that have come
  private val sumWord     = Reg(UInt(16.W)) // the last word of the load, which holds the checksum
  private val failed      = Reg(Bool())     // the EEPROM has not acknowledged, or the host has given up
  private val pending     = Reg(Bool())     // an answer of the I2C master or the register RAM is to come
  private val byte        = Reg(UInt(8.W))  // the byte that is being moved
  private val a5Middle    = Reg(UInt(4.W))  // A5[7:4], kept until it is written with the RX FIFO size
  private val loads       = running === Code.Reload.U
  private val wait0       = RegInit(0.U(log2Ceil(p.coreClockMhz * p.siiStartUs + 1).W))

  private val ownedByPdi = offered || taken
  ecatMayWrite := !ownedByPdi && state === idle
  pdiMayWrite  := ownedByPdi && state === idle
  writeEnable  := enable || taken
  waits        := state === serve
  // A host that emulates the EEPROM takes a command that it reads for one to carry out. It must see none
  // before the address stands there, too.
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

  // The command stands in 0x0503 and acts when that byte is written. The write enable of the same write has
  // come before, because 0x0502 is written first, or comes in the same cycle.
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

  private val names                          = new RegisterNames(RegisterMap(p))
  private def bytes(register: String): Range = names.register(register).range
  private val addressAt                      = bytes("eeprom_address").head
  private val dataAt                         = bytes("eeprom_data").head

  private val lastByte = count === Mux(loads, 15.U, 7.U)
  // The number of a byte is added to these addresses by an OR, so their low bits must be 0.
  for (
    (name, address, size) <- Seq(
      ("the scratch area", SiiRegisters.Scratch.start, 16),
      ("eeprom_data", dataAt, 8),
      ("eeprom_address", addressAt, 4)
    )
  )
    require(
      address % size == 0,
      f"$name is at 0x$address%04x but must be at a multiple of $size."
    )
  private val scratch = SiiRegisters.Scratch.start
  private val first   = if (p.hasI2c) start else point // the state with which a load begins

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
        Mux(loads, scratch.U | count, dataAt.U | count),
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
      val right = !failed && (sumWord(7, 0) === crc || sumWord === SiiRegisters.ChecksumOff.U) // SII-03
      count := 0.U
      when(right) {
        state := copy
      }.elsewhen(!again) { // there is one more try (SII-06)
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
      // The alias and some bits of the configuration are taken only from the first load (SII-08).
      val target = MuxLookup(count, 0.U(12.W))(
        (for ((first, register) <- SiiController.loaded(p); (a, i) <- bytes(register).zipWithIndex)
          yield (first + i).U -> a.U(12.W)) :+ (13.U -> names.field("rx_fifo_size").byte.U(12.W))
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
        // The checksum has been judged and is not needed any more, so its place keeps the new RX FIFO size.
        // A5 has that inverted.
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
      // Bit 3 of `count` says which half of the load the address is for; bits 1 and 0 number its bytes.
      crc := Mux(count(3), crc, ConfigurationChecksum.Start.U)
      store(addressAt.U | count(1, 0), Mux(count(1, 0) === 0.U && count(3), 4.U, 0.U), point)
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
    is(take) { fetchFrom(dataAt.U | count(2, 0), put) }
  }

  /** Drives the I2C master: each state gives it one command, some with a byte to send (SII-18, SII-19). */
  private def i2cEeprom(): Unit = {
    // The quarter is rounded up, so that the clock may be slower than asked for, but never faster.
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

    /** Has `command` done, and goes to `next` after it. A byte that is not acknowledged ends the transfer. */
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
        fetchFrom(addressAt.U, address1)
      }
      is(address1) {
        byteAddress := byte << 1
        fetchFrom((addressAt + 1).U, address2)
      }
      is(address2) {
        byteAddress := Cat(byte, byteAddress(8, 0))
        fetchFrom((addressAt + 2).U, start)
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
      is(fetch) { fetchFrom(dataAt.U | count, out) }
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

object SiiController {

  /** Which registers are loaded, and from which byte of the EEPROM on; what is not built is left out. */
  private def loaded(p: EscParams): Seq[(Int, String)] = Seq(
    0  -> "pdi_control",
    1  -> "esc_configuration_a0",
    2  -> "pdi_configuration",
    6  -> "extended_pdi_configuration",
    8  -> "station_alias",
    10 -> "esc_configuration_a5",
    12 -> "esc_configuration_a6"
  ) ++ Option.when(p.syncSignals > 0)(4 -> "sync_pulse_length")
}
