package flyframe.cosim

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{TestSets, Tier}
import flyframe.model._
import flyframe.params.EscParams
import flyframe.protocol.Command.{Brd, Bwr}
import flyframe.registers.{DlRegisters, RegisterMap}

/** Random frames, RTL against the golden model. `make fuzz` plays any number from any seed. */
class FuzzSpec extends AnyFlatSpec {
  // In `make test` those with more than a small share, and one of 125 MHz; MatrixSpec has sets like the rest.
  private val plan =
    if (Tier.isSoak) TestSets.fuzz
    else TestSets.fuzz.filter { case (p, share) => share > 5000 || p.preset == "mhz125-8" }
  private val option  = if (Tier.isSoak) "COSIM_OPT=-Os" else "COSIM_OPT=-O1"
  private val harness = new Harness("fuzz", plan.map(_._1), option)

  private val tier = Tier("random frames, RTL against the model", "frames", test = 5000, soak = 300000)
  private val Seed = 20261121L

  for ((p, weight) <- plan) {
    val frames = tier.share(weight, plan.map(_._2).sum).toInt
    val rules  = "FP, LP, ERR" + (if (p.hasAlarm) ", AP, ALARM, DET" else "")
    s"$rules: ${p.preset}" should s"answer $frames random frames as the model does" in {
      val last = tier.run(p.preset, frames, Some(Seed)) {
        harness.play(s"${p.preset}.vectors")(FuzzVectors.write(p, Seed, frames, _))
      }
      assert(last.contains("differences 0"), last)
      assert("frames (\\d+)".r.findFirstMatchIn(last).exists(_.group(1).toInt >= frames), last)
    }
  }

  /** The longest frames with the default RX FIFO and clocks 100 ppm apart; with the smallest one the longest
    * at 50 ppm, the shortest at 100. From frame to frame the phase between the clocks moves on, so that the
    * first symbol comes at every time of a nibble slot.
    */
  private def clocks(p: EscParams, out: java.io.PrintStream): Unit = {
    val writer = new VectorWriter(p, Seed, out, new EscModel(p))
    def frame(data: Int) = WireFrame.withFcs(
      EtherCatFrame(Seq(Datagram(Brd, 0, RegisterMap.UserRamStart, Seq.fill(data)(0x5a))), Encapsulation.Vlan)
    )
    val (longest, shortest) = (frame(1486), frame(1)) // 1,522 bytes and 64, FCS included
    def send(frame: WireFrame, ppm: Int): Unit = {
      writer.clockError(0, ppm)
      // From frame to frame 15.28 ns at 100 ppm: the golden section of a slot, which 34 steps fill evenly.
      for (_ <- 1 to (if (ppm < 0) 34 else 13)) writer.frame(0, frame, gap = 3820 - frame.symbols.size)
    }
    for (ppm <- Seq(-100, 100)) send(longest, ppm)
    writer.clockError(0, 0)
    writer.frame(0, WireFrame.withFcs(EtherCatFrame(Seq(Datagram(Bwr, 0, DlRegisters.FifoByte, Seq(0))))))
    for (ppm <- Seq(-50, 50)) send(longest, ppm)
    for (ppm <- Seq(-100, 100)) send(shortest, ppm)
    writer.checkpoint(0 until 0) // no error has been counted
  }
  for (name <- Seq("cyclone4-min", "mhz125-8"); p = TestSets.named(name).get)
    s"LP-12, PHY-03: ${p.preset}" should "pass the longest frames whatever the clocks do" in {
      val last = harness.play(s"${p.preset}-clocks.vectors")(clocks(p, _))
      assert(last.contains("differences 0"), last)
    }
}
