package flyframe.mi

import chisel3._
import chisel3.util._
import flyframe.params.EscParams

/** What is known of the PHY of a port (LNK-05), as its status register shows it. */
class PhyStatus extends Bundle {
  val physical     = Bool()
  val link         = Bool()
  val error        = Bool()
  val pollError    = Bool()
  val partnerError = Bool()
  val configured   = Bool()
}

/** Finds links through MII management: port after port it checks the PHY's configuration, until it is as
  * wanted and whenever the link has gone, and asks for its link (LNK-01 to LNK-06, B-93 to B-95).
  */
class LinkDetection(p: EscParams) extends Module {
  private val n = p.ports

  /** The link inputs, and the links of which MII management knows. */
  val signal = IO(Input(Vec(n, Bool())))
  val link   = IO(Output(Vec(n, Bool())))
  val status = IO(Output(Vec(n, new PhyStatus)))

  /** Poll errors and configurations have been seen. */
  val clear = IO(Input(Bool()))

  /** Restart the port's auto-negotiation; and it has been. */
  val restart   = IO(Input(Vec(n, Bool())))
  val restarted = IO(Output(Vec(n, Bool())))
  val access    = IO(new PhyAccess)

  private object Step extends ChiselEnum {

    /** `gigabit`, `advertise`, `control`: a register of the configuration is read, and written if it is not
      * as wanted; `linked`, `partner`: link and auto-negotiation are read, and what the partner can do.
      */
    val begin, gigabit, advertise, control, linked, partner = Value
  }
  import Step._

  private val step     = RegInit(begin)                    // reset: the first port is to be asked
  private val port     = RegInit(0.U(2.W))
  private val rewrites = RegInit(false.B)                  // the register of this step is being written
  private val changed  = Reg(Bool())                       // auto-negotiation is to begin anew
  private val complete = Reg(Bool())                       // auto-negotiation has ended
  private val looked   = Reg(Bool())                       // there was no link, which may be that of earlier
  private val checked  = RegInit(VecInit.fill(n)(false.B)) // the configuration, since the PHY last had a link
  private val known    = RegInit(VecInit.fill(n)(false.B)) // the PHY has been configured, and answers
  private val dropped  = RegInit(VecInit.fill(n)(false.B)) // the link input has fallen (LNK-03)
  private val shown    = RegInit(0.U.asTypeOf(Vec(n, new PhyStatus)))

  private def at[T <: Data](all: Seq[T]): T = VecInit(all.padTo(4, all.head))(port)
  private val isFx                          = at((0 until n).map(p.isFx(_).B))
  private val again                         = at(restart)

  // What is read or written, by the step.
  private val answer = access.answer
  private val wanted = Mux(isFx, Phy.Fixed.U, Phy.Restart.U)
  // Isolated, in power down or loop-back, there is no link; speed and duplex count if they are fixed.
  private val controlMask = Mux(isFx, 0x7d40.U, 0x5c00.U)
  private val (register, isWanted, value) = {
    val values = Seq[(Step.Type, (UInt, Bool, UInt))](
      gigabit   -> ((Phy.Gigabit.U(5.W), answer(9, 8) === 0.U, 0.U(16.W))),
      advertise -> ((Phy.Advertisement.U, answer(9, 5) === 8.U, Phy.OnlyFullTx.U)),
      control   -> ((Phy.Control.U, (answer & controlMask) === (wanted & controlMask) && !changed, wanted)),
      linked    -> ((Phy.Status.U, true.B, 0.U)),
      partner   -> ((Phy.Partner.U, true.B, 0.U))
    )
    def pick[T <: Data](field: ((UInt, Bool, UInt)) => T): T =
      MuxLookup(step, field(values.head._2))(values.map { case (s, v) => s -> field(v) })
    (pick(_._1), pick(_._2), pick(_._3))
  }
  access.valid    := step =/= begin
  access.port     := port
  access.register := register
  access.isWrite  := rewrites
  access.data     := value

  private def next(): Unit = {
    step := begin
    port := Mux(port === (n - 1).U, 0.U, port + 1.U)
  }

  /** The PHY has told all: whether it has a link, and whether that suits. */
  private def judge(hasLink: Bool, isComplete: Bool, partner: Bool): Unit = {
    for (y <- 0 until n) when(port === y.U) {
      checked(y)            := true.B
      known(y)              := true.B
      shown(y).link         := hasLink && isComplete && partner
      shown(y).error        := hasLink && !(isComplete && partner)
      shown(y).partnerError := hasLink && isComplete && !partner
    }
    next()
  }

  /** The PHY tells no link any more. */
  private def endLink(): Unit = for (y <- 0 until n) when(port === y.U) {
    checked(y)            := false.B
    shown(y).physical     := false.B
    shown(y).link         := false.B
    shown(y).error        := false.B
    shown(y).partnerError := false.B
  }

  when(clear) {
    shown.foreach { s =>
      s.pollError  := false.B
      s.configured := false.B
    }
  }
  when(step === begin) {
    changed := again
    looked  := false.B
    step    := Mux(at(checked) && !again, linked, Mux(isFx || at(checked), control, gigabit))
  }
  // A PHY that still resets itself need not take what is written: it has not answered yet (B-94).
  private val isSilent = !rewrites && (access.silent || (step === control && answer(15)))
  when(access.done) {
    when(rewrites) {
      rewrites := false.B
      changed  := true.B
      step     := step.next
      for (y <- 0 until n) when(port === y.U && !(again && step === control)) {
        shown(y).configured := true.B
      }
    }.elsewhen(isSilent) {
      endLink()
      for (y <- 0 until n) when(port === y.U) {
        known(y)           := false.B
        shown(y).pollError := true.B
      }
      next()
    }.elsewhen(!isWanted) {
      rewrites := true.B
    }.elsewhen(step === linked && !answer(2) && at(shown.map(_.physical))) {
      endLink() // the PHY may have been reset: first its configuration, even if there is a link again (B-93)
      step := begin
    }.elsewhen(step === linked && !answer(2) && !looked) {
      looked := true.B // the bit stays low until it has been read: once more
    }.otherwise {
      step := step.next
      when(step === linked) {
        complete := answer(5)
        for (y <- 0 until n) when(port === y.U) { shown(y).physical := answer(2) }
        when(isFx || !answer(2)) { judge(answer(2), true.B, true.B) }
      }
      when(step === partner) { judge(at(shown.map(_.physical)), complete, answer(8)) }
    }
  }

  for (y <- 0 until n) {
    val tellsNone = access.done && !isSilent && step === linked && port === y.U && !answer(2) && looked
    val falls     = RegNext(signal(y), false.B) && !signal(y)
    dropped(y)   := !signal(y) && !tellsNone && (dropped(y) || falls)
    link(y)      := Mux(known(y), shown(y).link && !dropped(y) && (signal(y) || !falls), signal(y))
    restarted(y) := access.done && rewrites && step === control && port === y.U
  }
  status := shown
}
