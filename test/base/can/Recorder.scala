package flyframe.can

import java.nio.file.{Files, Path}

/** A controller whose bus is recorded. */
class Recorder(device: CanUnderTest) extends CanUnderTest {
  private var level   = true
  private val changes = Vector.newBuilder[(Long, Boolean)]

  def cycle: Long     = device.cycle
  def driven: Boolean = device.driven

  def step(heard: Boolean): Unit = {
    if (heard != level) changes += cycle -> heard
    level = heard
    device.step(heard)
  }

  def write(address: Int, bytes: Seq[Int]): Unit = device.write(address, bytes)
  def read(address: Int, count: Int): Seq[Int]   = device.read(address, count)

  /** Writes what was on the bus as VCD.
    *
    * @param cyclesPer100ns
    *   core cycles of a unit of time
    */
  def writeVcd(file: Path, cyclesPer100ns: Int): Unit = {
    val text = new StringBuilder(
      "$timescale 100 ns $end\n$var wire 1 ! bus $end\n$enddefinitions $end\n#0\n1!\n"
    )
    for ((cycle, high) <- changes.result()) text ++= s"#${cycle / cyclesPer100ns}\n${if (high) 1 else 0}!\n"
    text ++= s"#${cycle / cyclesPer100ns}\n"
    Files.writeString(file, text.toString)
  }
}
