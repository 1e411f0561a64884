package flyframe.can

import java.nio.file.{Files, Path}

/** A controller of which is recorded what it hears. */
class Recorder(device: CanUnderTest) extends CanUnderTest {
  private val done   = Vector.newBuilder[(Boolean, Long)]
  private var heard  = true
  private var cycles = 0L

  def cycle: Long     = device.cycle
  def driven: Boolean = device.driven

  def step(level: Boolean): Unit = {
    if (level != heard) {
      if (cycles > 0) done += heard -> cycles
      cycles = 0
      heard = level
    }
    cycles += 1
    device.step(level)
  }

  def write(address: Int, bytes: Seq[Int]): Unit = device.write(address, bytes)
  def read(address: Int, count: Int): Seq[Int]   = device.read(address, count)

  /** Writes what it heard as VCD, but for the time that accesses of the host take.
    *
    * @param cyclesPer100ns
    *   core cycles of a unit of time
    */
  def writeVcd(file: Path, cyclesPer100ns: Int): Unit = {
    val text = new StringBuilder("$timescale 100 ns $end\n$var wire 1 ! bus $end\n$enddefinitions $end\n")
    val end = (done.result() :+ (heard -> cycles)).foldLeft(0L) { case (begin, (level, cycles)) =>
      text ++= s"#${begin / cyclesPer100ns}\n${if (level) 1 else 0}!\n"
      begin + cycles
    }
    Files.writeString(file, text.append(s"#${end / cyclesPer100ns}\n").toString)
  }
}
