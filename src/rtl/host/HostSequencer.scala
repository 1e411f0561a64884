package flyframe.host

import chisel3._
import chisel3.util._
import flyframe.lanes.Lanes
import flyframe.memory._
import flyframe.params.EscParams
import flyframe.registers.{Register, RegisterMap}
import flyframe.syncmanager.{AreaPort, AreaScan, ManagedSpace}

/** Takes the host's accesses to memory through the SyncManagers, byte by byte in ascending order (B-44);
  * those to registers pass as they are.
  *
  * @param added
  *   registers beside those of the units
  */
class HostSequencer(p: EscParams, added: Seq[Register] = Nil) extends Module {
  private val lanes   = p.lanes
  private val managed = new ManagedSpace(p, RegisterMap(p, added))

  val host   = IO(new HostPort(lanes))
  val memory = IO(Flipped(new HostPort(lanes)))
  val areas  = IO(Flipped(new AreaPort(p)))

  /** No access is under way. */
  val quiet = IO(Output(Bool()))

  private object State extends ChiselEnum {

    /** How far the access is. From `scan` to `next` it is about one byte, and each byte begins with `scan`.
      *   - `idle`: there is no access.
      *   - `pass`: SyncManagers do not act on the address, so the whole word goes to the memory unchanged.
      *   - `scan`: the SyncManager in whose area the byte lies is searched; a byte that is not enabled is
      *     left out. The first byte is the lowest one that is enabled.
      *   - `ask`: that SyncManager is asked whether the byte may be accessed, and the request waits for its
      *     turn.
      *   - `answer`: the answer comes a cycle after the request was granted.
      *   - `choose`: by the answer, the byte's address in its buffer is chosen, or the byte is left out.
      *   - `access`: the byte is at the memory.
      *   - `close`: the SyncManager is told that the byte was accessed, so that the last one closes the
      *     buffer. The access is done if no further byte is enabled, else the next one begins.
      *   - `next`: the same behind the last byte of a buffer, or a byte that is left out.
      */
    val idle, pass, scan, ask, answer, choose, access, close, next = Value
  }
  import State._
  private val state = RegInit(idle) // reset: no access
  quiet := state === idle
  private val lane    = Reg(UInt((log2Ceil(lanes) max 1).W))
  private val data    = Reg(UInt((8 * lanes).W))
  private val through = Reg(UInt(18.W)) // the byte's address at the memory, which is that in its buffer
  private val count   = Reg(UInt(4.W))

  private val address = Cat(host.addr >> log2Ceil(lanes), if (lanes == 1) 0.U(0.W) else lane)
  private val enabled = if (lanes == 1) host.be(0) else host.be(lane)

  // The search asks for the entries of each bank at the counts from 0 on, the first of an access before that.
  // An entry comes a count later, and is compared in two more.
  private val lastEntry = (p.syncManagers min 8) - 1
  private val found     = count === (lastEntry + 3).U
  areas.index := Mux(count > lastEntry.U, lastEntry.U, count(2, 0))
  private val area = AreaScan.lowest(areas.entries.map { entry =>
    val scan = Module(new AreaScan(p.smIndexBits))
    scan.entry        := entry
    scan.entry.begins := RegNext(count === 0.U)
    // The last entry stays selected until the access is done. A SyncManager that is switched on meanwhile
    // must not be found when its byte is already half way.
    scan.entry.takesPart := entry.takesPart && count < (lastEntry + 2).U
    scan.address         := address
    scan.result
  })
  private val single = area.first && area.last
  private val exists = managed.exists(address, areas.ramOpen)
  // A SyncManager may have been switched off since the search found it; its area is plain memory again
  // (SM-28).
  private val plain    = !area.hit || (!areas.answer.works && !areas.answer.locked)
  private val may      = plain || (exists && areas.answer.allowed)
  private val inBuffer = Reg(Bool()) // the access has the direction of the byte's SyncManager
  // A buffer may reach beyond 64 KiB, or to a register that SyncManagers do not act on: nothing is accessed
  // there.
  private val outside = through(17, 16).orR || managed.isOther(through(15, 0))

  // Opening belongs to the question whether the byte may be accessed, so it happens with `ask`. A buffer of
  // one byte is opened and closed by the same access (B-53), so both happen with `close`; they act at once
  // (B-58).
  areas.number             := area.index
  areas.request            := (state === ask && area.hit) || (state === close && inBuffer)
  areas.turn               := areas.request
  areas.access.write       := host.write
  areas.access.touch       := exists && (state === ask) =/= single
  areas.access.first       := area.first
  areas.access.single      := single
  areas.access.close       := state === close && area.last
  areas.access.address     := 0.U // it matters where ECAT writes
  areas.access.acknowledge := exists && state === ask && area.last && host.write

  // While a frame's end is carried out, buffers have changed hands and registers have not. The host must not
  // see that state, so reads wait for its end (B-57).
  memory.req := (state === pass && (host.write || !areas.changing)) ||
    (state === access && !outside)
  memory.write := host.write
  memory.addr  := Mux(state === pass, host.addr, through(15, 0))
  // The buffers follow each other at any length, so that a byte may lie in another lane than at its address.
  private val there = Lanes.of(through, lanes)
  private val here  = if (lanes == 1) 0.U else lane
  memory.wdata := Mux(state === pass, host.wdata, Fill(lanes, Lanes.bytes(host.wdata, lanes)(here)))
  memory.be    := Mux(state === pass, host.be, UIntToOH(there, lanes))
  host.rdata   := Mux(state === pass, memory.rdata, data)
  host.ack     := false.B

  private def goesOn(): Unit = {
    count := 0.U
    lane  := lane + 1.U
    state := scan
    when(!((host.be >> 1) >> lane).orR) {
      host.ack := true.B
      state    := idle
    }
  }

  switch(state) {
    is(idle) {
      lane  := PriorityEncoder(host.be)
      count := 0.U
      data  := 0.U
      when(host.req) {
        state := Mux(managed.acts(host.addr), scan, pass)
        count := 1.U
      }
    }
    is(pass) {
      host.ack := memory.ack
      when(memory.ack) { state := idle }
    }
    is(scan) {
      count := count + 1.U
      when(!enabled) { state := next }.elsewhen(found) { state := ask }
    }
    is(ask) {
      when(!area.hit) { state := choose }.elsewhen(areas.granted) { state := answer }
    }
    is(answer) { state := choose }
    is(choose) {
      inBuffer := area.hit && exists && areas.answer.inBuffer
      through  := address +& Mux(!plain && !single, areas.offset, 0.U)
      state    := Mux(may, access, next)
    }
    is(access) {
      when(memory.ack) {
        data := data | (Fill(lanes, Lanes.bytes(memory.rdata, lanes)(there)) & FillInterleaved(
          8,
          UIntToOH(here, lanes)
        ))
      }
      when(memory.ack || outside) { state := close }
    }
    is(close) {
      // What the last byte of a buffer does shows a cycle later, and the host must not see it done before.
      when(!inBuffer) { goesOn() }
        .elsewhen(areas.granted) { when(area.last) { state := next }.otherwise { goesOn() } }
    }
    is(next) { goesOn() }
  }
}
