package flyframe.report

import java.nio.file.{Files, Paths}
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.{Emit, TestSets}

/** The packing count on netlists small enough to count by hand. */
class NetlistSpec extends AnyFlatSpec {
  private def lut(out: Int) =
    s"""{"type": "cycloneive_lcell_comb", "connections": {"combout": [$out], "dataa": [2], "datab": ["1"]}}"""
  private def flop(d: String, q: Int) = s"""{"type": "dffeas", "connections": {"d": [$d], "q": [$q]}}"""
  private def ram(words: Int, width: Int) = {
    def bits(v: Int) = "\"" + v.toBinaryString + "\""
    s"""{"type": "altsyncram", "parameters": {"numwords_a": ${bits(words)}, "width_a": ${bits(width)}},
       | "connections": {}}""".stripMargin
  }
  private def module(cells: String*) =
    ujson.read(
      cells.zipWithIndex.map { case (c, i) => s""""c$i": $c""" }.mkString("""{"cells": {""", ", ", "}}")
    )

  "A register" should "share the logic element of the LUT at its D input" in {
    assert(Netlist.own(module(lut(10), flop("10", 11))).logicElements == 1)
  }

  it should "take one of its own behind a pin, a constant or another register" in {
    val area = Netlist.own(module(lut(10), flop("3", 11), flop("\"0\"", 12), flop("11", 13)))
    assert(area == Area(luts = 1, ffs = 3, paired = 0))
    assert(area.logicElements == 4)
  }

  "A LUT" should "take one register only" in {
    val area = Netlist.own(module(lut(10), lut(20), flop("10", 11), flop("10", 12), flop("20", 21)))
    assert(area == Area(luts = 2, ffs = 3, paired = 2))
    assert(area.logicElements == 3)
  }

  "An unmapped cell" should "count as one LUT for each output bit" in {
    val not = """{"type": "$not", "connections": {"A": [2, 3], "Y": [10, 11]}}"""
    assert(Netlist.own(module(not, flop("10", 20))) == Area(luts = 2, ffs = 1, paired = 1))
  }

  "A memory" should "count as one M9K block if it fits one" in {
    assert(Netlist.own(module(ram(256, 32), ram(2048, 4))) == Area(m9k = 2, ramBits = 16384))
    assertThrows[ReportError](Netlist.own(module(ram(2048, 8))))
  }

  "Units" should "contain the modules below them" in {
    val receiver = """{"type": "Receiver_2", "connections": {}}"""
    val netlist = ujson.read(s"""{"modules": {
      "top_1": {"cells": {"a": $receiver, "b": $receiver, "l": ${lut(5)}}},
      "Receiver_2": {"cells": {"r": {"type": "$$paramod$$12ab\\\\Inner", "connections": {}}, "l": ${lut(5)}}},
      "$$paramod$$12ab\\\\Inner": {"cells": {"f": ${flop("3", 4)}}},
      "dffeas": {"attributes": {"blackbox": "1"}, "cells": {}}
    }}""")
    val units = Netlist.byUnit(netlist, "top_1", "rest", Map("Receiver" -> "receivers").get)
    assert(units == Map("rest" -> Area(luts = 1), "receivers" -> Area(luts = 2, ffs = 2)))
  }

  "Modules that units begin at" should "be those of some preset, or of a slave with all there is" in {
    val complete = TestSets.fuzz.map(_._1).find(_.preset == "complete-3").get
    val verilog =
      Points.presets.map(p => Files.readString(Paths.get(s"generated/${p.preset}.v"))) ++
        (complete +: TestSets.hosts).map(Emit.verilog)
    val modules = verilog.flatMap("(?m)^module (\\w+)".r.findAllMatchIn(_).map(_.group(1)))
    assert(Points.units.flatMap(_._2).filterNot(modules.map(Netlist.plainName).toSet) == Nil)
  }

  they should "be those of some preset of the fibre ring" in {
    val verilog = RingPoints.presets.map(p => Files.readString(Paths.get(s"generated/${p.preset}.v")))
    val modules = verilog.flatMap("(?m)^module (\\w+)".r.findAllMatchIn(_).map(_.group(1)))
    assert(RingPoints.units.flatMap(_._2).filterNot(modules.map(Netlist.plainName).toSet) == Nil)
  }

  "A module name" should "lose parameters and numbers" in {
    assert(Netlist.plainName("$paramod$43b0\\DualPortRam") == "DualPortRam")
    assert(Netlist.plainName("$paramod\\DualPortRam\\DEPTH=s32'1") == "DualPortRam")
    assert(Netlist.plainName("LevelCrossing_1") == "LevelCrossing")
  }
}
