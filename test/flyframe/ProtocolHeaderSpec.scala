package flyframe

import java.nio.file.{Files, Paths}
import scala.sys.process._
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.{Codes, Layout}

/** The header that the firmware includes: a C compiler finds the same numbers in it as RTL and server use. */
class ProtocolHeaderSpec extends AnyFlatSpec {
  private val codes =
    for (g <- Codes.all; c <- g.all) yield (if (g.name.isEmpty) c.name else s"${g.name}_${c.name}") -> c.value
  private val fields = for {
    l                <- Layout.all
    f                <- l.fields
    (suffix, number) <- Seq("at" -> f.offset, "bytes" -> f.bytes)
  } yield s"${l.name}_${f.name}_$suffix" -> number
  private val lengths = Layout.all.map(l => s"${l.name}_bytes" -> l.bytes)
  private val numbers = (codes ++ fields ++ lengths).map { case (name, number) =>
    s"PROTOCOL_${name.toUpperCase}" -> number
  }

  "generated/protocol.h" should "be what the sources emit, as simulator and host programs use it" in {
    assert(Files.readString(Paths.get("generated/protocol.h")) == Documents.protocolHeader)
  }

  "protocol.h" should "give a C compiler the numbers of Scala, each once" in Directory { directory =>
    assert(numbers.map(_._1).distinct.size == numbers.size)
    Files.writeString(directory.resolve("protocol.h"), Documents.protocolHeader)
    val prints = numbers.map { case (name, _) => s"""printf("$name %d\\n", (int)$name);""" }
    Files.writeString(
      directory.resolve("main.c"),
      s"""#include <stdio.h>
         |#include "protocol.h"
         |#include "protocol.h"
         |int main(void) {
         |  ${prints.mkString("\n  ")}
         |  return 0;
         |}
         |""".stripMargin
    )
    val program = directory.resolve("main").toString
    val compile = Seq("cc", "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-o", program)
    assert((compile :+ directory.resolve("main.c").toString).! == 0)
    assert(program.!!.linesIterator.toSeq == numbers.map { case (name, number) => s"$name $number" })
  }

  it should "hold nothing else" in {
    val names = "PROTOCOL_\\w+(?= *=)".r.findAllIn(Documents.protocolHeader).toSeq
    assert(names.sorted == numbers.map(_._1).sorted)
  }
}
