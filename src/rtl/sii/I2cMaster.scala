package flyframe.sii

import chisel3._
import chisel3.util._

/** What an I2C master is asked to do next. */
object I2cCommand extends ChiselEnum {

  /** start: a START, also a repeated one; write: a byte, and look for the acknowledge; read: a byte and give
    * an acknowledge; readLast: a byte without acknowledge; stop: a STOP.
    */
  val start, write, read, readLast, stop = Value
}

/** A point-to-point I2C master that does one command at a time (SII-16 to SII-20). Lines are open drain.
  *
  * @param quarter
  *   core cycles in a quarter of a clock period
  */
class I2cMaster(quarter: Int) extends Module {
  val command = IO(Flipped(Decoupled(I2cCommand())))
  val data    = IO(Input(UInt(8.W))) // byte to write, with `command`

  /** The command is done: the byte read, and whether the other side acknowledged a byte written. */
  val done         = IO(Output(Bool()))
  val received     = IO(Output(UInt(8.W)))
  val acknowledged = IO(Output(Bool()))

  /** 1 pulls the line low. */
  val sclLow = IO(Output(Bool()))
  val sdaLow = IO(Output(Bool()))
  val sda    = IO(Input(Bool())) // synchronous

  private val timer = RegInit(0.U(log2Ceil(quarter max 2).W))
  private val tick  = timer === (quarter - 1).U
  timer := Mux(tick, 0.U, timer + 1.U)

  private val busy     = RegInit(false.B) // reset: lines free
  private val what     = Reg(I2cCommand())
  private val phase    = Reg(UInt(2.W))
  private val bitsLeft = Reg(UInt(4.W))
  private val shift    = Reg(UInt(9.W))
  private val scl      = RegInit(true.B)
  private val line     = RegInit(true.B)
  private val isByte   = what =/= I2cCommand.start && what =/= I2cCommand.stop
  private val end      = busy && tick && phase === 3.U && (!isByte || bitsLeft === 0.U)

  command.ready := !busy
  when(command.fire) {
    busy     := true.B
    what     := command.bits
    phase    := 0.U
    bitsLeft := 8.U
    // Nine bits: eight of data and the acknowledge; those the other side drives are 1 here.
    shift := Mux(
      command.bits === I2cCommand.write,
      Cat(data, 1.U(1.W)),
      Cat("hff".U(8.W), command.bits === I2cCommand.readLast)
    )
  }
  when(busy && tick) {
    phase := phase + 1.U
    when(isByte) {
      // Clock low, data set; clock high, data taken; clock low.
      when(phase === 0.U) { line := shift(8) }
      when(phase === 1.U) { scl := true.B }
      when(phase === 2.U) { shift := Cat(shift(7, 0), sda) }
      when(phase === 3.U) {
        scl      := false.B
        bitsLeft := bitsLeft - 1.U
      }
    }.otherwise {
      // START: data high, clock high, data low, clock low. STOP: data low, clock high, data high.
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
