package flyframe.frame

import chisel3._

/** The schedule of [[TranslatedAccess]]: what happens in which core cycle of a byte time. Cycle 0 is the
  * first one after the last nibble of a byte.
  *
  *   - 0: map looks at FMMU 0 and counts the logical address; a byte is looked up to be read; ECAT closes
  *     what has been read; the lower byte of what has been written is complete;
  *   - 1: FMMU 1; ECAT touches or closes what has been written; the upper byte of that is complete;
  *   - 2: FMMU 2; what the search before has found is asked for; may the byte that comes be written?
  *   - 3: FMMU 3; area keeps what was found, and begins with SyncManager 0; of the byte before, what is known
  *     by its address;
  *   - 4: FMMU 4; a local address is counted; the answer to cycle 2: the place to write to;
  *   - 5: FMMU 5; the area of the byte before is known: may it be read? A buffer is opened. The place to
  *     write to is looked up;
  *   - 7: FMMU 7; the answer to cycle 5: the place to read from; and whether the place of cycle 5 is
  *     writable.
  *
  * A byte time has eight cycles or more. What lies between tables and results: [[flyframe.fmmu.FmmuBank]],
  * [[flyframe.syncmanager.AreaScan]].
  */
class Schedule extends Bundle {

  /** The last cycle of a byte time: the last nibble of a byte is there. */
  val ends = Bool()

  /** 15: after the last byte of a datagram. */
  val cycle = UInt(4.W)

  /** The byte time, modulo 4. */
  val number = UInt(2.W)

  private def is(n: Int): Bool = cycle === n.U

  def countLogical: Bool = is(0)
  def countLocal: Bool   = is(4)
  def lookUpRead: Bool   = is(0)
  def close: Bool        = is(0)
  def touch: Bool        = is(1)
  def askMapped: Bool    = is(2)
  def askWrite: Bool     = is(2)
  def keepMapped: Bool   = is(3)
  def keepWrite: Bool    = is(4)
  def askRead: Bool      = is(5)
  def lookUpWrite: Bool  = is(5)
  def keepRead: Bool     = is(7)

  /** The SyncManagers are asked or told something. */
  def turn: Bool = close || touch || askWrite || askRead

  /** Even for writes, odd for reads, where one address is chosen for both. */
  def forRead: Bool = cycle(0)

  /** The FMMU that is looked at. */
  def entry: UInt = Mux(cycle(3), 7.U, cycle(2, 0))
}

/** Counts core cycles within byte times, see [[Schedule]]. */
class ByteTimes extends Module {

  /** The last nibble of a byte is there. */
  val ends     = IO(Input(Bool()))
  val schedule = IO(Output(new Schedule))

  private val cycle  = RegInit(15.U(4.W)) // reset: long after any byte
  private val number = Reg(UInt(2.W))
  when(ends) {
    cycle  := 0.U
    number := number + 1.U
  }.elsewhen(!cycle.andR) { cycle := cycle + 1.U }
  schedule.ends   := ends
  schedule.cycle  := cycle
  schedule.number := number
}
