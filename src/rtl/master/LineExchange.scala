package flyframe.master

import chisel3._
import chisel3.util._
import flyframe.ethernet.{EthernetReceiver, EthernetSender}
import flyframe.mii.NibbleStream
import flyframe.ram.DualPortRam

/** Exchanges frames with the slaves of a line: sends a frame, and waits for its answer; without a right one
  * in time it is sent again (MST-07, MST-08). The answers are kept until the next frame is begun.
  *
  * Use: `clear`; the bytes of datagrams; `go`; wait for `done`; read the answers.
  *
  * @param linePorts
  *   1, or 2: the ends of a ring; a frame leaves at one of them and comes back at either
  */
class LineExchange(linePorts: Int) extends Module {
  import LineExchange._

  /** Once per nibble slot. */
  val step   = IO(Input(Bool()))
  val in     = IO(Input(Vec(linePorts, new NibbleStream)))
  val out    = IO(Output(Vec(linePorts, new NibbleStream)))
  val source = IO(Input(UInt(48.W))) // MAC address, first byte in the low bits

  /** Begins a frame, which is to leave at the second port if `atSecond` says so, then and until it is over.
    */
  val clear    = IO(Input(Bool()))
  val atSecond = IO(Input(Bool()))
  val byte     = IO(Flipped(Valid(UInt(8.W))))

  /** A frame is being sent. */
  val sending = IO(Output(Bool()))

  /** Sends what has been composed, while not `sending`. How long to wait for an answer, in slots; how often
    * to send again.
    */
  val go      = IO(Input(Bool()))
  val timeout = IO(Input(UInt(16.W)))
  val retries = IO(Input(UInt(4.W)))

  /** The exchange is over; true: with a right answer, `fromSecond`: which came in at the second port. */
  val done       = IO(Output(Valid(Bool())))
  val fromSecond = IO(Output(Bool()))

  /** A frame was sent in vain: for counting. */
  val lost = IO(Output(Bool()))

  /** Answers there are after a good exchange, and a word of the one at `read` a cycle later, of
    * [[AnswerWord]].
    */
  val count  = IO(Output(UInt((NumberBits + 1).W)))
  val read   = IO(Input(UInt(NumberBits.W)))
  val place  = IO(Input(UInt(3.W)))
  val answer = IO(Output(UInt(16.W)))

  /** The answer with this number is kept for the host, that of each end, until the next one that is; a word
    * of it a cycle later, of [[AnswerWord]], of the frame of the second end if `keptSecond`.
    */
  val keeps      = IO(Flipped(Valid(UInt(4.W))))
  val keptSecond = IO(Input(Bool()))
  val keptPlace  = IO(Input(UInt(3.W)))
  val kept       = IO(Output(UInt(16.W)))

  private val composer = Module(new FrameComposer)
  private val sender   = Module(new EthernetSender)
  private val receiver = Module(new EthernetReceiver)
  private val matcher  = Module(new AnswerMatcher)
  composer.source := source
  composer.clear  := clear
  composer.byte   := byte
  composer.look   := matcher.look
  sender.step     := step
  sender.bytes <> composer.bytes
  receiver.step  := step
  matcher.byte   := receiver.byte
  matcher.first  := receiver.first
  matcher.end    := receiver.end
  matcher.length := composer.length
  matcher.sent   := composer.sent

  // The second port is listened to: the one that has given the last right answer is preferred, and after a
  // frame in vain the other one, so that none can drown the other.
  private val listens = RegInit(false.B) // reset: to the first one
  private val prefers = RegInit(false.B)
  if (linePorts == 1) {
    out(0)      := sender.out
    receiver.in := in(0)
  } else {
    for (y <- 0 to 1) {
      val sends = atSecond === (y == 1).B
      out(y)       := sender.out
      out(y).valid := sender.out.valid && sends
      out(y).end   := sender.out.end && sends
    }
    val now = Mux(in(prefers.asUInt).busy, prefers, Mux(in(!prefers.asUInt).busy, !prefers, listens))
    when(step) { listens := now }
    receiver.in := in(now.asUInt)
  }
  fromSecond := prefers

  // Answers.
  private val came    = RegInit(0.U((NumberBits + 1).W)) // of the frame at hand; reset: none
  private val had     = RegInit(0.U((NumberBits + 1).W))
  private val waiting = RegInit(false.B)                 // for an answer; reset: not
  private val begun   = RegInit(false.B)                 // a frame came while waiting; reset: none
  private val word    = matcher.word.bits
  private val room    = begun && waiting && !came(NumberBits)
  private val stores  = matcher.word.valid && room
  private def copy(depth: Int, write: Bool, writeAddress: UInt, readAddress: UInt): UInt = {
    val ram = DualPortRam(depth * AnswerWord.Count, 16)(clock)
    ram.io.write        := write
    ram.io.writeAddress := writeAddress
    ram.io.writeData    := word.data
    ram.io.readAddress  := readAddress
    ram.io.readData
  }
  private val isKept = keeps.valid && came === keeps.bits
  answer := copy(1 << NumberBits, stores, Cat(came(NumberBits - 1, 0), word.place), Cat(read, place))
  kept   := copy(2, stores && isKept, Cat(atSecond, word.place), Cat(keptSecond, keptPlace))
  count  := had
  when(receiver.byte.valid && receiver.first) {
    came  := 0.U
    begun := waiting
  }.elsewhen(matcher.whole && room) { came := came + 1.U }

  // Sending, and waiting.
  private val left  = Reg(UInt(16.W))                                                // slots
  private val tries = Reg(UInt(4.W))                                                 // that are left
  private val good  = matcher.done.valid && matcher.done.bits && begun && waiting
  private val late  = waiting && left === 0.U && !composer.busy && !receiver.in.busy // for it to begin
  composer.send := go || (late && tries =/= 0.U && !good)
  sending       := composer.busy
  done.valid    := good || (late && tries === 0.U)
  done.bits     := good
  lost          := late && !good

  when(clear) { begun := false.B } // what is on its way is an answer to something else
  when(step && left =/= 0.U && !composer.busy) { left := left - 1.U }
  when(go) {
    waiting := true.B
    tries   := retries
    left    := timeout
  }.elsewhen(good) {
    waiting := false.B
    had     := came
    prefers := listens
  }.elsewhen(late) {
    when(tries === 0.U) { waiting := false.B }
    tries   := tries - 1.U
    left    := timeout
    prefers := !prefers
  }
}

object LineExchange {

  /** Bits of the number of an answer: 64 answers of a frame are kept. */
  val NumberBits = 6
}
