package flyframe.memory

import flyframe.registers.Register

/** A unit of a slave controller behind its registers. It owns them: it brings their table, and connects
  * itself to them by their names. Not a module, but a part of the controller that makes it; what it builds in
  * its constructor or in `connect` is in that.
  *
  * @param registers
  *   its table; of a unit of this repository it is in `src/base/registers`, where model and documents find it
  */
abstract class RegisterUnit(val registers: Seq[Register]) {

  /** Connects the unit to its registers; called once. */
  def connect(bus: RegisterBus): Unit
}
