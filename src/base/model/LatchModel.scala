package flyframe.model

import flyframe.params.EscParams
import flyframe.registers.Register

/** LATCH signal `n`: the system time of its edges (DC-37 to DC-41). */
class LatchModel(p: EscParams, registers: ModelRegisters, n: Int) extends ModelUnit {
  private val edges = Seq("negative", "positive") // by the level behind them
  private var level = 0
  private val event = Array(false, false)

  private def isSingle(edge: Int): Boolean = registers.value(s"latch${n}_${edges(edge)}_single") == 1
  private def byPdi: Boolean               = registers.value(s"latch${n}_by_pdi") == 1

  /** The pin has a level. */
  def set(high: Boolean, time: Long): Unit = {
    val now = if (high) 1 else 0
    if (now != level && !(isSingle(now) && event(now))) {
      val name = s"latch${n}_${edges(now)}_time"
      registers.setWide(name, if (registers.bytes(name) == 8) time else time & 0xffffffffL)
      event(now) = isSingle(now)
    }
    level = now
  }

  /** The unit is not there (DC-06). */
  def switchOff(): Unit = for (e <- edges.indices) event(e) = false

  override def guard(name: String): Option[Boolean] =
    if (name == s"latch${n}_of_ecat") Some(!byPdi)
    else if (name == s"latch${n}_of_pdi") Some(byPdi)
    else None

  private def shows(edge: Int): Int = if (event(edge) && isSingle(edge)) 1 else 0
  override def status(field: String): Option[Int] =
    if (field == s"latch${n}_pin") Some(level)
    else edges.indices.find(e => field == s"latch${n}_${edges(e)}").map(shows)

  /** An event that its owner, host or bus, has not read. */
  def waits(host: Boolean): Boolean = byPdi == host && edges.indices.exists(shows(_) == 1)

  private def read(register: Register, host: Boolean): Unit =
    for (e <- edges.indices if register.name == s"latch${n}_${edges(e)}_time" && byPdi == host)
      event(e) = false
  override def acknowledged(register: Register, address: Int): Unit =
    if (!p.acknowledgesByWrite || address == register.address) read(register, host = true)
  override def readByEcat(register: Register): Unit = read(register, host = false)
}
