package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.memory.DualPortRam
import flyframe.mii.NibbleStream

/** Exchanges frames with the slaves of a line: composes a frame, sends it, and waits for its answer; without
  * a right one in time it is sent again (MST-07, MST-08). The answers are kept until the next frame is begun.
  *
  * Use: `clear`; datagrams with their data; `go`; wait for `done`; read the answers.
  *
  * @param maxSubTelegrams
  *   datagrams of a frame that is sent
  * @param answers
  *   datagrams of an answer that are kept, those of slaves included, a power of two
  */
class LineExchange(maxSubTelegrams: Int, answers: Int = 32) extends Module {

  /** Once per nibble slot. */
  val step   = IO(Input(Bool()))
  val in     = IO(Input(new NibbleStream))
  val out    = IO(Output(new NibbleStream))
  val source = IO(Input(UInt(48.W))) // MAC address, first byte in the low bits

  val clear    = IO(Input(Bool()))
  val datagram = IO(Flipped(Decoupled(new DatagramToSend)))
  val data     = IO(Flipped(Decoupled(UInt(8.W))))
  val full     = IO(Output(Bool()))

  /** A datagram is being taken, or a frame is being sent. */
  val composing = IO(Output(Bool()))

  /** Sends what has been composed, while not `composing`. How long to wait for an answer, in slots; how often
    * to send again.
    */
  val go      = IO(Input(Bool()))
  val timeout = IO(Input(UInt(16.W)))
  val retries = IO(Input(UInt(4.W)))
  val busy    = IO(Output(Bool()))

  /** The exchange is over; true: with a right answer. */
  val done = IO(Output(Valid(Bool())))

  /** A frame was sent in vain: for counting. */
  val lost = IO(Output(Bool()))

  /** Answers there are after a good exchange, and a word of the one at `read` a cycle later, of
    * [[AnswerWord]].
    */
  val count  = IO(Output(UInt(log2Ceil(answers + 1).W)))
  val read   = IO(Input(UInt(log2Ceil(answers).W)))
  val place  = IO(Input(UInt(3.W)))
  val answer = IO(Output(UInt(16.W)))

  /** The first answer is `kept` for the host, until the next one that is: byte `keptAddress` of its words a
    * cycle later.
    */
  val keeps       = IO(Input(Bool()))
  val keptAddress = IO(Input(UInt(4.W)))
  val keptData    = IO(Output(UInt(8.W)))

  private val composer = Module(new FrameComposer(maxSubTelegrams))
  private val sender   = Module(new EthernetSender)
  private val receiver = Module(new EthernetReceiver)
  private val matcher  = Module(new AnswerMatcher(maxSubTelegrams))
  composer.source := source
  composer.clear  := clear
  composer.datagram <> datagram
  composer.data <> data
  full        := composer.full
  sender.step := step
  sender.bytes <> composer.bytes
  out                  := sender.out
  receiver.step        := step
  receiver.in          := in
  matcher.byte         := receiver.byte
  matcher.first        := receiver.first
  matcher.end          := receiver.end
  matcher.clear        := clear
  matcher.expect.valid := datagram.fire
  matcher.expect.bits  := datagram.bits

  // Answers.
  private val came    = RegInit(0.U(log2Ceil(answers + 1).W)) // of the frame at hand; reset: none
  private val kept    = RegInit(0.U(log2Ceil(answers + 1).W))
  private val waiting = RegInit(false.B)                      // for an answer; reset: not
  private val begun   = RegInit(false.B)                      // a frame came while waiting; reset: none
  private val word    = matcher.word.bits
  private val stores  = matcher.word.valid && begun && waiting && came =/= answers.U
  private def copy(write: Bool, address: UInt): UInt = {
    val ram = DualPortRam(answers * AnswerWord.Count, 16)(clock)
    ram.io.write        := write
    ram.io.writeAddress := Cat(came, word.place)
    ram.io.writeData    := word.data
    ram.io.readAddress  := address
    ram.io.readData
  }
  answer := copy(stores, Cat(read, place))
  private val forHost = copy(stores && keeps, keptAddress(3, 1))
  keptData := Mux(RegNext(keptAddress(0)), forHost(15, 8), forHost(7, 0))
  count    := kept
  when(receiver.byte.valid && receiver.first) {
    came  := 0.U
    begun := waiting
  }.elsewhen(stores && word.place === AnswerWord.Counter.U) { came := came + 1.U }

  // Sending, and waiting.
  private val left  = Reg(UInt(16.W)) // slots
  private val tries = Reg(UInt(4.W))  // that are left
  private val good  = matcher.done.valid && matcher.done.bits && begun && waiting
  private val late  = waiting && left === 0.U && !composer.busy
  composer.send := go || (late && tries =/= 0.U && !good)
  busy          := waiting
  composing     := composer.busy
  done.valid    := good || (late && tries === 0.U)
  done.bits     := good
  lost          := late && !good

  when(clear) {
    kept  := 0.U
    begun := false.B // what is on its way is an answer to something else
  }
  when(step && left =/= 0.U && !composer.busy) { left := left - 1.U }
  when(go) {
    waiting := true.B
    tries   := retries
    left    := timeout
  }.elsewhen(good) {
    waiting := false.B
    kept    := came
  }.elsewhen(late) {
    when(tries === 0.U) { waiting := false.B }
    tries := tries - 1.U
    left  := timeout
  }
}
