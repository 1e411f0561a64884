package flyframe.registers

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.TestSets
import flyframe.params.{EscParams, Presets}
import RegisterTable._

/** Registers that a product adds: each one that the RTL cannot have is refused in one sentence. */
class RegisterMapSpec extends AnyFlatSpec {
  private val slave  = Presets.named("slave").get.params
  private val plain  = Presets.named("cyclone4-min").get.params
  private val alarm  = Presets.named("alarm-slave").get.params
  private val widths = Seq(8, 16, 32)

  private def added(name: String, address: Int, bytes: Int, source: Source, ecat: Side = rw): Register =
    register(
      address,
      bytes,
      name,
      ecat,
      r,
      "GEN-04",
      name,
      field(s"${name}_field", 8 * bytes - 1, 0, source, 0, name)
    )
  private def inRam(address: Int, bytes: Int = 1, name: String = "bell"): Register =
    added(name, address, bytes, ram)
  private def inFlipFlops(address: Int, bytes: Int = 1, name: String = "tone", ecat: Side = rw): Register =
    added(name, address, bytes, stored, ecat)

  private def accepted(p: EscParams, registers: Register*): Unit =
    assert(registers.toSet.subsetOf(RegisterMap(p, registers).toSet))
  private def refused(p: EscParams, registers: Register*)(words: String*): Unit = {
    val message = intercept[IllegalArgumentException](RegisterMap(p, registers)).getMessage
    assert(message.endsWith(".") && message.count(_ == '.') == 1, message)
    for (word <- words) assert(message.contains(word), message)
  }

  // ---- places of the register RAM ----

  "A register in RAM at the SII unit's scratch bytes" should "be refused with an EEPROM" in {
    for (sii <- Seq(1, 2); address <- Seq(0x0f60, 0x0f6f, 0x0e68))
      refused(slave.copy(sii = sii), inRam(address))(
        f"register bell is at 0x$address%04x to 0x$address%04x",
        "must not have the low seven bits of 0x0560 to 0x056f"
      )
    refused(slave, inRam(0x0f5c, 8))("register bell is at 0x0f5c to 0x0f63")
  }
  it should "be accepted beside them, in flip-flops, and without an EEPROM" in {
    for (width <- widths; p = slave.copy(dataBusWidth = width)) {
      accepted(p, inRam(0x0f5f), inRam(0x0f70, name = "text"))
      accepted(p, inFlipFlops(0x0f60, 16))
      accepted(p.copy(sii = 0), inRam(0x0f60, 16))
    }
  }

  "Two registers in RAM with the same low seven bits" should "be refused" in {
    refused(slave, inRam(0x0f20), inRam(0x0e20, name = "text"))(
      "register bell is",
      "0x0f20",
      "text is at 0x0e20",
      "0x20"
    )
    refused(alarm, inRam(0x0f1c, 8))(
      "bell is at 0x0f1c to 0x0f23",
      "0x1c",
      "alarm_message is at 0x0e98 to 0x0e9f"
    )
  }
  it should "be accepted if it is their words only that have them" in {
    for (width <- widths)
      accepted(
        slave.copy(dataBusWidth = width),
        inRam(0x0f20),
        inRam(0x0e21, name = "text"),
        inRam(0x0e22, 2, "more")
      )
  }

  "A register in a word with one in RAM" should "not have the low seven bits of another one in RAM" in {
    // The RTL tells writes to the register RAM by words: that of the tone would reach the text's place.
    val registers = Seq(inRam(0x0f20), inFlipFlops(0x0f21), inRam(0x0e21, name = "text"))
    accepted(slave.copy(dataBusWidth = 8), registers: _*)
    for (width <- Seq(16, 32))
      refused(slave.copy(dataBusWidth = width), registers: _*)(
        "tone is at 0x0f21",
        "text is at 0x0e21",
        "0x21"
      )
    val further = Seq(inRam(0x0f20), inFlipFlops(0x0f22), inRam(0x0e22, name = "text"))
    accepted(slave.copy(dataBusWidth = 16), further: _*)
    refused(slave.copy(dataBusWidth = 32), further: _*)("tone is at 0x0f22", "text is at 0x0e22", "0x22")
  }
  it should "be accepted if nobody writes it, or nothing in RAM has them" in {
    val constant = added("tone", 0x0f21, 1, RegisterTable.constant, r)
    for (width <- widths; p = slave.copy(dataBusWidth = width)) {
      accepted(p, inRam(0x0f20), constant, inRam(0x0e21, name = "text"))
      accepted(p, inRam(0x0f20), inFlipFlops(0x0f21), inFlipFlops(0x0e21, name = "text"))
    }
  }
  "A register in RAM" should "be refused where the SII unit writes another one in its word" in {
    val bell = inRam(0x0f41) // 0x0141, in flip-flops, stands beside 0x0140
    accepted(slave, bell)
    for (width <- Seq(16, 32))
      refused(slave.copy(dataBusWidth = width), bell)(
        "bell is at 0x0f41",
        "esc_configuration_a0 is at 0x0141"
      )
  }

  it should "be refused without a register RAM, with a reset value, with reserved bits" in {
    refused(plain, inRam(0x0f20))("register bell", "must have none")
    val bell = inRam(0x0f20)
    refused(slave, bell.copy(fields = bell.fields.map(_.copy(reset = 7))))(
      "register bell",
      "reset value 7",
      "reset value 0"
    )
    refused(slave, bell.copy(fields = bell.fields.map(_.copy(high = 5))))("register bell", "6 bits", "all 8")
  }

  // ---- places of units ----

  "A register of a block" should "be refused, as blocks are those of FMMUs and SyncManagers" in {
    for (r <- Seq(inRam(0x0f20), inFlipFlops(0x0f20), inRam(0x0680)))
      refused(slave, r.copy(block = Some(Block(0, 2, 16))))(
        s"register ${r.name} is one of 2",
        "must be in none"
      )
  }
  "A register where the register RAM is cleared by its addresses" should "be refused" in {
    for (
      address <- Seq(0x0510, 0x0560, 0x057f, 0x0680, 0x06ff, 0x0840, 0x087f);
      r       <- Seq(inRam(address), inFlipFlops(address))
    )
      refused(slave, r)(
        f"register ${r.name} is at 0x$address%04x",
        "must be outside of 0x0500 to 0x057f, 0x0600 to 0x06ff, 0x0800 to 0x087f"
      )
    accepted(slave, inFlipFlops(0x0580), inFlipFlops(0x05ff, name = "a"), inFlipFlops(0x0700, name = "b"))
    accepted(plain, inFlipFlops(0x0680))
  }
  "A register" should "be in front of the user RAM" in {
    accepted(slave, inFlipFlops(0x0f7f))
    for ((address, bytes) <- Seq(0x0f80 -> 1, 0x0f7f -> 2, 0x1000 -> 1))
      refused(slave, inFlipFlops(address, bytes))(f"tone is at 0x$address%04x", "must be at 0x0000 to 0x0f7f")
  }
  it should "not stand on another one, and have fields of its own names" in {
    refused(slave, inFlipFlops(0x0131))("tone is at 0x0131 to 0x0131", "0x0132 or above", "al_status")
    refused(slave, inFlipFlops(0x0f20, 8), inFlipFlops(0x0f27, name = "text"))(
      "text is at 0x0f27",
      "0x0f28 or above",
      "tone"
    )
    refused(slave, inFlipFlops(0x0f20), inFlipFlops(0x0f30))("field tone_field stands in 2 places")
  }

  // ---- properties ----

  "A managed register" should "be at 0x0F00 to 0x0F7F" in {
    def managed(address: Int, bytes: Int) = inFlipFlops(address, bytes).copy(managed = true)
    for ((address, bytes) <- Seq(0x0f00 -> 1, 0x0f00 -> 128, 0x0f7c -> 4, 0x0f20 -> 32))
      accepted(slave, managed(address, bytes))
    for ((address, bytes) <- Seq(0x0efc -> 4, 0x0e00 -> 16, 0x0580 -> 4))
      refused(slave, managed(address, bytes))(f"tone is at 0x$address%04x", "must be at 0x0f00 to 0x0f7f")
    // Also without SyncManagers, so that the table fits all of a product's parameters.
    refused(plain, managed(0x0e00, 4))("must be at 0x0f00 to 0x0f7f")
  }
  it should "have a power of two of bytes" in {
    for (bytes <- Seq(3, 5, 6, 12, 100))
      refused(slave, inFlipFlops(0x0f00, bytes).copy(managed = true))(
        "register tone",
        s"$bytes bytes",
        "1, 2, 4, 8, 16, 32, 64 or 128"
      )
  }
  it should "be at a multiple of its bytes" in {
    for ((address, bytes) <- Seq(0x0f01 -> 2, 0x0f04 -> 8, 0x0f10 -> 32))
      refused(slave, inFlipFlops(address, bytes).copy(managed = true))(
        f"tone is at 0x$address%04x",
        s"a multiple of its $bytes bytes"
      )
  }
  it should "share no word of four bytes with one that is not" in {
    val text = inFlipFlops(0x0f10, 2, "text").copy(managed = true)
    refused(slave, text, inFlipFlops(0x0f12))("text is at 0x0f10 to 0x0f11", "outside of 0x0f10 to 0x0f13")
    accepted(slave, text, inFlipFlops(0x0f14))
  }
  "A bitWritable register" should "need digitalOutputs if FMMUs map bits" in {
    refused(slave, inFlipFlops(0x0f20).copy(bitWritable = true))(
      "register tone",
      "digitalOutputs is 0",
      "1 to 4"
    )
    accepted(slave.copy(digitalOutputs = 1), inFlipFlops(0x0f20).copy(bitWritable = true))
    accepted(slave.copy(fmmuBitwise = 0), inFlipFlops(0x0f20).copy(bitWritable = true))
  }

  // ---- what is not added ----

  "The registers of the repository" should "fit in every parameter set with every width of the data bus" in {
    val sets = Presets.allRegisters +: (Presets.all.map(_.params) ++ TestSets.rules ++ TestSets.matrix)
    for (p <- sets; width <- widths) assert(RegisterMap(p.copy(dataBusWidth = width)).nonEmpty)
  }
  "A register's own data" should "be refused in one sentence if they do not fit together" in {
    def sentence(make: => Any)(words: String*): Unit = {
      val message = intercept[IllegalArgumentException](make).getMessage
      assert(message.endsWith(".") && words.forall(message.contains), message)
    }
    sentence(field("x", 1, 2, stored, 0, "x"))("field x", "1 to 2")
    sentence(field("x", 1, -1, stored, 0, "x"))("field x", "1 to -1")
    sentence(register(0, 1, "bell", rw, r, "", "", field("x", 8, 0, stored, 0, "x")))(
      "field x",
      "8 to 0",
      "7 to 0",
      "bell"
    )
    sentence(register(0, 0, "bell", rw, r, "", ""))("register bell", "0 bytes", "1 or more")
    sentence(
      register(0, 1, "bell", rw, r, "", "", field("x", 0, 0, ram, 0, "x"), field("y", 1, 1, stored, 0, "y"))
    )("register bell", "1 fields in RAM", "all 2 or none")
    sentence(Source.Stored(hardwareSet = true, mirrored = true))("hardwareSet is true")
    sentence(RegisterRam.Area(0x0510, 7, 0))("0x0510", "multiples of 128")
  }
}
