package flyframe.mi

import chisel3._
import chisel3.util._
import flyframe.clocks.LevelCrossing
import flyframe.memory.{RegisterBus, RegisterUnit}
import flyframe.params.EscParams
import flyframe.registers.MiRegisters

/** MII management behind its registers (MI-02 to MI-10): commands of bus and host, between which the
  * controller's own accesses are served.
  */
class MiUnit(p: EscParams, val pins: MiPins) extends RegisterUnit(MiRegisters(p)) {
  private object Code {
    val Clear = 0
    val Read  = 1
    val Write = 2
  }
  private val mdio = Module(new Mdio(p.coreClockMhz)).suggestName("mdio")

  /** The controller's own accesses, where it has some; a command comes first. */
  val own: Option[PhyAccess] = Option.when(p.hasOwnMiAccesses)(Wire(Flipped(new PhyAccess)))

  private def portAddress(port: UInt): UInt =
    VecInit((0 until 4).map(y => p.phyAddress(y).U(5.W)))(port)

  def connect(bus: RegisterBus): Unit = {
    pins.mdc         := mdio.mdc
    pins.mdio_out    := mdio.mdioOut
    pins.mdio_enable := mdio.mdioEnable
    mdio.mdioIn      := LevelCrossing(pins.mdio_in)

    // Reset: no command, no error, and ECAT has the interface without leave to write.
    val enable       = RegInit(false.B)
    val busy         = RegInit(false.B)
    val isWrite      = Reg(Bool())
    val readError    = RegInit(false.B)
    val commandError = RegInit(false.B)
    val taken        = if (p.hasMiByPdi) RegInit(false.B) else false.B
    val endsCommand  = Wire(Bool())

    val command = bus.written("mi_command")
    val low     = bus.written("mi_write_enable")
    when(bus.nextFrame) { enable := false.B }
    when(low.valid && !bus.writtenByHost) { enable := low.bits }
    when(endsCommand) {
      busy := false.B
      when(mdio.silent) { readError := true.B }
    }
    // One that comes while another runs was on its way before; it is dropped (B-91).
    when(command.valid && !busy) {
      val code  = command.bits
      val may   = taken || Mux(low.valid, low.bits(0), enable)
      val valid = code === Code.Read.U || (code === Code.Write.U && may)
      readError    := false.B
      commandError := !valid && code =/= Code.Clear.U
      busy         := valid
      isWrite      := code(1)
    }

    // The PHY that the registers mean.
    val phy    = bus.value("mi_phy_address")
    val isOff  = bus.bool("mi_translation_off")
    val isPort = phy < 4.U
    val (added, base) =
      (phy + p.phyAddress(0).U(5.W), if (p.phyAddresses < 0) None else Some(portAddress(phy(1, 0))))
    val translated = Mux(isOff, phy, base.fold(added)(Mux(isPort, _, added)))
    mdio.phy         := translated
    mdio.phyRegister := bus.value("mi_register_address")
    mdio.isWrite     := isWrite

    // A command stands before its address and data in the order of bytes: it waits until all are written.
    // Behind that nobody may write them until it is done.
    val bytes = bus.writtenBytes("mi_data")
    if (own.isEmpty) {
      mdio.run    := busy
      mdio.delays := bus.writesPending
      endsCommand := mdio.done
      mdio.load.zip(bytes).foreach { case (load, byte) => load := byte }
      bus.status("mi_data") := mdio.data
    }
    for (access <- own) {
      val data  = RegInit(VecInit.fill(2)(0.U(8.W))) // reset: as the register table has it
      val runs  = RegInit(false.B)                   // reset: no access
      val isOwn = Reg(Bool())                        // the access is of the controller itself
      val ready = busy && !bus.writesPending
      val next  = Mux(ready, data.asUInt, access.data)
      for (i <- 0 to 1) when(bytes(i).valid) { data(i) := bytes(i).bits }
      when(!runs) {
        runs  := ready || access.valid
        isOwn := !ready
      }
      when(mdio.done) { runs := false.B }
      when(endsCommand) { data := mdio.data.asTypeOf(data) }
      when(isOwn) {
        mdio.phy         := portAddress(access.port)
        mdio.phyRegister := access.register
        mdio.isWrite     := access.isWrite
      }
      mdio.run    := runs
      mdio.delays := false.B
      endsCommand := mdio.done && !isOwn
      for (i <- 0 to 1) {
        mdio.load(i).valid := !runs
        mdio.load(i).bits  := next(8 * i + 7, 8 * i)
      }
      access.done           := mdio.done && isOwn
      access.answer         := mdio.data
      access.silent         := mdio.silent
      bus.status("mi_data") := data.asUInt
    }

    // What keeps ECAT off when a frame begins does so to its end, so that all of its datagrams are treated
    // alike (B-92). Reset: nothing.
    val wasBusy  = RegEnable(busy, false.B, bus.nextFrame)
    val wasTaken = if (p.hasMiByPdi) RegEnable(taken, false.B, bus.nextFrame) else false.B
    val isFree   = !taken && !wasTaken

    // Not while a frame is under way, whose writes have been accepted when ECAT had the interface (B-92).
    if (p.hasMiByPdi) {
      val force  = RegInit(false.B) // reset: not by force
      val takes  = bus.written("mi_taken")
      val forces = bus.written("mi_force")
      when(takes.valid && bus.writtenByHost) { taken := takes.bits }
      when(forces.valid && !bus.writtenByHost) { force := forces.bits }
      when(force) { taken := false.B }
      bus.guard("mi_pdi_may_take") := !force && (taken ||
        (!bus.bool("mi_exclusive") && !bus.frameOpen))
      bus.guard("mi_ecat_may_claim") := isFree
      bus.guard("mi_pdi_may_write")  := taken && !busy
      if (p.hasMiLinks) {
        bus.guard("mi_ecat_may_clear") := isFree
        bus.guard("mi_pdi_may_clear")  := taken
      }
      bus.status("mi_taken") := taken
      bus.status("mi_force") := force
    }
    bus.guard("mi_ecat_may_write") := isFree && !busy && !wasBusy
    bus.status("mi_write_enable")  := enable || taken
    bus.status("mi_port_address")  := Mux(isOff, portAddress(phy(1, 0)), p.phyAddress(0).U)
    bus.status("mi_command")       := Mux(busy, Cat(isWrite, !isWrite), 0.U)
    bus.status("mi_read_error")    := readError
    bus.status("mi_command_error") := commandError
    bus.status("mi_busy")          := busy
  }
}
