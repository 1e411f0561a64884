package flyframe.model

import flyframe.registers.Register

/** A unit of the modelled controller behind its registers. It knows those of its own and ignores others. */
trait ModelUnit {

  /** The value of a status field, if it is one of this unit's. */
  def status(field: String): Option[Int] = None

  /** Whether a guard of this unit's registers holds now. */
  def guard(name: String): Option[Boolean] = None

  /** A write of `byte` to `address` has taken effect. */
  def written(register: Register, address: Int, byte: Int, byHost: Boolean): Unit = ()

  /** The host acknowledges what `register` tells of: it has read the byte at `address`, or tries to write it,
    * where it acknowledges by writing (PDI-09).
    */
  def acknowledged(register: Register, address: Int): Unit = ()

  /** ECAT has read a byte of `register`, in a frame that has ended well. */
  def readByEcat(register: Register): Unit = ()
}
