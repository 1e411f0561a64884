package flyframe.sii

import chisel3._
import chisel3.util._

/** What an I2C master is asked to do next. */
object I2cCommand extends ChiselEnum {

  /** What is done on the lines.
    *   - `start`: a START is sent, which may be a repeated one.
    *   - `write`: a byte is sent, and it is seen whether the other side acknowledges it.
    *   - `read`: a byte is received and acknowledged, so that the other side sends the next one.
    *   - `readLast`: a byte is received and not acknowledged, so that the other side lets go of the lines.
    *   - `stop`: a STOP is sent.
    */
  val start, write, read, readLast, stop = Value
}

/** A point-to-point I2C master that does one command at a time (SII-16 to SII-20). The lines are open drain:
  * it pulls them low or lets go of them.
  *
  * @param quarter
  *   core cycles in a quarter of a clock period
  */
class I2cMaster(quarter: Int) extends Module {
  val command = IO(Flipped(Decoupled(I2cCommand())))
  val data    = IO(Input(UInt(8.W))) // byte to write, with `command`

  /** High in the last cycle of a command. Then `received` is the byte that was read, and `acknowledged` says
    * whether the other side acknowledged the byte that was written.
    */
  val done         = IO(Output(Bool()))
  val received     = IO(Output(UInt(8.W)))
  val acknowledged = IO(Output(Bool()))

  /** 1 pulls the line low. */
  val sclLow = IO(Output(Bool()))
  val sdaLow = IO(Output(Bool()))
  val sda    = IO(Input(Bool())) // level of the line, already in the core clock

  private val timer = RegInit(0.U(log2Ceil(quarter max 2).W))
  private val tick  = timer === (quarter - 1).U
  timer := Mux(tick, 0.U, timer + 1.U)

  private val busy     = RegInit(false.B) // a command is being done; reset: none
  private val what     = Reg(I2cCommand())
  private val phase    = Reg(UInt(2.W))
  private val bitsLeft = Reg(UInt(4.W))
  private val shift    = Reg(UInt(9.W))
  private val scl      = RegInit(true.B)  // reset: the clock line is free
  private val line     = RegInit(true.B)  // reset: the data line is free
  private val isByte   = what =/= I2cCommand.start && what =/= I2cCommand.stop
  private val end      = busy && tick && phase === 3.U && (!isByte || bitsLeft === 0.U)

  command.ready := !busy
  when(command.fire) {
    busy     := true.B
    what     := command.bits
    phase    := 0.U
    bitsLeft := 8.U
    // A byte has nine bits, eight of data and the acknowledge. Where the other side drives the line, the bit
    // is 1 here, so that the line is let go.
    shift := Mux(
      command.bits === I2cCommand.write,
      Cat(data, 1.U(1.W)),
      Cat("hff".U(8.W), command.bits === I2cCommand.readLast)
    )
  }
  when(busy && tick) {
    phase := phase + 1.U
    when(isByte) {
      // The data line changes while the clock is low, and is sampled in the middle of the time it is high.
      when(phase === 0.U) { line := shift(8) }
      when(phase === 1.U) { scl := true.B }
      when(phase === 2.U) { shift := Cat(shift(7, 0), sda) }
      when(phase === 3.U) {
        scl      := false.B
        bitsLeft := bitsLeft - 1.U
      }
    }.otherwise {
      // For a START the data line goes high, then the clock; then data falls, and the clock after it. For a
      // STOP data goes low, then the clock high; then data rises, and both lines stay free.
      val starts = what === I2cCommand.start
      when(phase === 0.U) { line := starts }
      when(phase === 1.U) { scl := true.B }
      when(phase === 2.U) { line := !starts }
      when(phase === 3.U) { scl := !starts }
    }
  }
  when(end) { busy := false.B }
  done         := end
  received     := shift(8, 1)
  acknowledged := !shift(0)
  sclLow       := !scl
  sdaLow       := !line
}
