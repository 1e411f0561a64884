package flyframe.board

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.report.Netlist

/** What holds for the project of every board, checked without Quartus. */
trait BoardBehaviour { this: AnyFlatSpec =>

  /** Tests of a board.
    *
    * @param userPins
    *   user pins of its package by number, with their kind
    */
  protected def aBoard(board: BoardFiles, userPins: Map[Int, String]): Unit = {
    it should "have no missing module but the PLL" in {
      val modules = board.design("modules").obj
      val missing = modules.values
        .flatMap(_("cells").obj.values.map(_("type").str))
        .toSet
        .filterNot(kind => kind.startsWith("$") || modules.contains(kind))
      val boxes = modules.filter(_._2("attributes").obj.contains("blackbox")).keySet
      assert(missing.isEmpty)
      assert(boxes.map(Netlist.plainName) == Set("altpll"))
    }

    it should "lint without a warning" in assert(board.lint() == "")

    it should "have a user pin of the package for every port" in {
      val slow = board.project.collect { case s"port $port IO_MAXIMUM_TOGGLE_RATE {0 MHz}" => port }.toSet
      assert(board.pins.map(_._1).sorted == board.ports.keys.toSeq.sorted)
      assert(
        board.pins.map(_._2).distinct.size == board.pins.size,
        board.pins.groupBy(_._2).filter(_._2.size > 1)
      )
      for ((port, pin) <- board.pins) {
        assert(userPins.get(pin).exists(_ != "memory"), s"$port on pin $pin")
        assert(userPins(pin) != "in" || board.ports(port) == "input", s"$port on pin $pin")
        assert((userPins(pin) == "slow") == slow(port), s"$port on pin $pin")
      }
      for ((port, pin) <- board.pins if port == "clk_50" || port.endsWith("_rx_clk"))
        assert(userPins(pin) == "in", port)
    }

    it should "see no access of a host whose pins are open" in
      assert(
        board.project.collect { case s"port $port WEAK_PULL_UP_RESISTOR ON" => port }.toSet ==
          Set("bus_ne", "bus_noe", "bus_nwe")
      )

    it should "match every name in the constraints, and leave no pin without one" in {
      // The clocks' pins have a clock.
      val named = board.constraints.map(_._2).toSet
      val bare  = board.ports.keySet -- named - "clk_50" - "mii_0_rx_clk" - "mii_1_rx_clk" - "mii_2_rx_clk"
      assert(bare.isEmpty)
      val first = board.registers.filter(r => r.matches(".*Crossing:[^|]*\\|(meta|taken)[^|]*"))
      assert(first.size > 13 + 8 + 3)
      assert(first.exists(_.contains("|LevelCrossing:")))
      // A reset's registers are named by their clear; of a sample with a falling edge the pin is, as for all
      // inputs.
      val otherwise = ".*(ResetCrossing|EdgeSampleCrossing:[^|]*\\|(meta|taken)).*"
      for (register <- first if !register.matches(otherwise)) assert(named(register), register)
      // Strobes have a limit where they decide what is taken, too.
      val limited = board.constraints.collect { case ("max=8", name) => name }.toSet
      for (register <- first if register.contains("MemoryBusCrossing") && register.contains("|taken"))
        assert(limited(register), register)
    }

    it should s"have ${board.coreClockMhz} MHz, as generated, at the PLL and in the constraints" in {
      assert(board.project.contains(s"parameter CORE_MHZ ${board.coreClockMhz}"))
      val pll = board
        .design("modules")
        .obj
        .values
        .flatMap(_("cells").obj.values)
        .find(_("type").str.contains("altpll"))
        .get
      val factor = pll("parameters")("clk0_multiply_by").str
      assert(Integer.parseInt(factor, 2) * 50 == board.coreClockMhz)
      assert(board.clockFile.contains(s"set core_mhz ${board.coreClockMhz}"))
      // The pointers of the MII receivers have one core cycle.
      val limits = board.constraints.collect {
        case (s"max=$ns", name) if name.matches(".*readSide\\|meta.*") => ns.toDouble
      }
      assert(limits.nonEmpty == board.ports.contains("phy_clk"))
      assert(limits.forall(_ == 1000.0 / board.coreClockMhz))
    }
  }
}
