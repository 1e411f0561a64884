package flyframe.relay

import flyframe.can.CanFrame
import flyframe.registers.CanRegisters
import scala.util.Random

/** The bridge of port F in relay mode, where frames come from both sides at once and close behind each other,
  * and a request of the host may take many bits.
  */
class RelayBridgeSpec extends RelayCases {
  protected def withNode(body: RelayUnderTest => Unit): Unit = RelaySimulation(body, RelaySimulation.Bridged)

  private val LoopBack = 1 << 2 // of no effect here (RB-12)
  private val Joins    = 1 << 6
  private val f        = CanRegisters.PortStarts(0)
  private val t        = CanRegisters.PortStarts(1)

  private def word(b: RelayBench, at: Int) =
    b.node.read(at, 2).zipWithIndex.map { case (x, i) => x << 8 * i }.sum

  /** The frames in slots of port T that are pending. */
  private def pairSlots(b: RelayBench) = {
    val pending = word(b, t + CanRegisters.Requests)
    (0 until 16).filter(s => (pending >> s & 1) == 1).map { s =>
      CanFrame.of(
        b.node.read(CanRegisters.SlotStarts(1) + s * CanRegisters.FrameBytes, CanRegisters.FrameBytes)
      )
    }
  }

  /** Two frames that end in the same bit, one at each port, and two more right behind. */
  private def four(b: RelayBench, random: Random, sequence: Int): Seq[CanFrame] = {
    val frames = Seq.fill(4)(
      CanFrame(
        random.nextInt(1 << 29),
        extended = true,
        remote = false,
        8,
        Seq.fill(8)(random.nextInt(256))
      )
    )
    def levels(n: Int) = RelayBench.levels(from(3 + n, sequence, direction = 1 - n % 2), frames(n))
    val end            = Seq.fill(LinkFrame.EndBits)(true)
    val longest        = (levels(0).size max levels(1).size) + 20
    for (port <- 0 to 1) {
      b.send(port, Seq.fill(longest - levels(port).size)(true) ++ levels(port) ++ end)
      b.send(port, Seq.fill(random.nextInt(2))(true) ++ levels(2 + port) ++ end)
    }
    b.run(longest + LinkFrame.EndBits - 8 + random.nextInt(12))
    frames
  }

  private def start(b: RelayBench, control: Int): Unit = {
    b.write(f, control)
    b.write(CanRegisters.FilterStarts(0), Seq.fill(CanRegisters.FilterBytes)(0): _*) // what `start` has set
    b.write(CanRegisters.FilterStarts(0) + 8 * CanRegisters.FilterBytes, 0, 0, 0, 0x20, 0, 0, 0, 0)
    for (slot <- 0 until 16)
      b.node.write(CanRegisters.SlotStarts(0) + slot * CanRegisters.FrameBytes, data(0x100 + slot).bytes())
  }

  for ((isRead, control) <- Seq(true -> Joins, false -> (Joins | LoopBack)))
    s"BR-01, FR-59, RB-12: frames that are bridged${if (isRead) "" else " past a full FIFO"}" should
      "all arrive, while the host requests all slots" in bench(retries = 0, confirmUs = 40) { b =>
        val random = new Random(1)
        start(b, control)
        var all = Seq.empty[CanFrame]
        for (round <- 1 to 40) {
          val came = four(b, random, sequence = round)
          b.node.write(f + CanRegisters.Requests, Seq(0xff, 0xff))
          b.finish()
          if (isRead) assert(b.received().toSet == came.toSet, s"round $round")
          all ++= came
          // The slots of the pair keep those that are first in CAN order.
          val left = pairSlots(b)
          assert(
            left.size == (all.size min 8) && left.toSet == all.sortBy(_.order).take(8).toSet,
            s"round $round"
          )
          all = left
          if (round % 3 == 0) {
            b.node.write(t + CanRegisters.Aborts, Seq(0xff, 0xff))
            all = Nil
          }
          b.node.write(f + CanRegisters.Aborts, Seq(0xff, 0xff))
          b.run(300)
        }
      }
}
