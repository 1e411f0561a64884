package flyframe.memory

import chisel3._

/** What happens to buffers, of whatever SyncManager: one that a good frame has closed changes hands, the host
  * begins with one, and closes one.
  */
class BufferEvents extends Bundle {
  val byEcat = Bool()
  val begun  = Bool()
  val byPdi  = Bool()
}
