package flyframe.ram

import chisel3.Clock
import chiseltest._

/** The block RAM behind a unit that uses one of somebody else. */
class RamContents(use: RamUse, size: Int) {
  val words: Array[BigInt] = Array.fill(size)(BigInt(0))

  /** A cycle. */
  def step(clock: Clock): Unit = {
    val read = words(use.readAddress.peek().litValue.toInt)
    if (use.write.peek().litToBoolean)
      words(use.writeAddress.peek().litValue.toInt) = use.writeData.peek().litValue
    clock.step()
    use.readData.poke(read)
  }
}
