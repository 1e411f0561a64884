package flyframe.ram

import chisel3.Clock
import chiseltest._

/** The block RAM behind a unit that uses one of somebody else. */
class RamContents(use: RamUse, size: Int) {
  val words: Array[BigInt] = Array.fill(size)(BigInt(0))

  /** A cycle. */
  def step(clock: Clock): Unit = {
    val read = words(use.readAddress.peekInt().toInt)
    if (use.write.peekBoolean())
      words(use.writeAddress.peekInt().toInt) = use.writeData.peekInt()
    clock.step()
    use.readData.poke(read)
  }
}
