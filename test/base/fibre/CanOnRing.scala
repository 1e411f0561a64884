package flyframe.fibre

import flyframe.can._
import flyframe.registers.RingRegisters

/** A ring in bus mode with a CAN controller in each node, as its tester meets it: golden models or RTL. */
trait CanOnRing {

  /** The host of each node. */
  def hosts: IndexedSeq[LowerTester]

  /** Runs so many bits. */
  def run(bits: Double): Unit

  /** Both fibres behind a node are cut, or mended. */
  def cut(link: Int, isCut: Boolean = true): Unit

  /** A byte of the ring's registers in a node. */
  def ring(node: Int, address: Int): Int

  def guards: Seq[Int]   = hosts.indices.filter(n => (ring(n, RingRegisters.State) >> 2 & 1) == 1)
  def closings: Seq[Int] = hosts.indices.map(ring(_, RingRegisters.Closings))

  /** Runs until all requests are done, for `bits` at most, and the bus is idle then.
    *
    * @return
    *   bits until the guard, if there was one, was none any more
    */
  def finish(bits: Int): Int = {
    var passed   = 0
    var closedAt = Option.empty[Int]
    while (hosts.exists(_.pending != 0) && passed < bits) {
      run(2)
      passed += 2
      if (closedAt.isEmpty && guards.isEmpty) closedAt = Some(passed)
    }
    run(12)
    closedAt.getOrElse(passed)
  }

  /** Errors of every kind that the nodes have counted, lost arbitrations left out. */
  def errors: Seq[Int] = hosts.map(_.counters.take(5).sum)

  /** How often a node has repeated one of its last few frames: each adds 8 (CAN-31), each success takes 1. */
  def repeats(node: Int): Int = (hosts(node).tec + 7) / 8

  /** One end of the line sends, and behind its frame both ends do: the other one, whose bits are those of the
    * first one and late by the way there, wins in the last bit of the identifier. The bit in front of it is
    * recessive, so that nothing late looks like it.
    *
    * @param frames
    *   at least so many, three for each such arbitration
    * @return
    *   all came, without an error
    */
  def arbitrate(frames: Int): Boolean = {
    def frame(node: Int, number: Int) = CanOnRing.frame(node, number, dlc = 1)
    val ends                          = Seq(0, hosts.size - 1)
    (0 until (frames + 2) / 3).forall { number =>
      val Seq(first, other) = if (number % 2 == 0) ends else ends.reverse
      hosts(first).request(frame(0, number))
      run(30)
      hosts(first).requestAt(1 -> frame(7, number))
      hosts(other).request(frame(6, number))
      finish(300)
      val got = Seq(first, other).map(hosts(_).received())
      hosts.foreach(_.received())
      errors.forall(_ == 0) && got == Seq(Seq(frame(6, number)), Seq(frame(0, number), frame(7, number)))
    }
  }
}

object CanOnRing {

  /** A frame that tells its sender; the identifiers of all senders differ in their last bits only. */
  def frame(node: Int, number: Int, dlc: Int = 2): CanFrame =
    CanFrame(0x555 & ~0x7 | node & 7, extended = false, remote = false, dlc, Seq.fill(dlc)(number & 0xff))
}
