package flyframe.protocol

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.Presets
import flyframe.registers.{AlarmRegisters, MasterRegisters, Register}

class LayoutSpec extends AnyFlatSpec {
  private def hex(bytes: Array[Byte]) = bytes.map(b => f"$b%02x").mkString

  "A layout" should "put numbers where its fields are, in its order, and read them again" in {
    val big = AcknowledgementLayout.encode(
      AcknowledgementLayout.Magic  -> 0x4641,
      AcknowledgementLayout.Master -> 0x1234,
      AcknowledgementLayout.Number -> 0xfedcba98L
    )
    assert(hex(big) == "4641000012340000fedcba98")
    assert(AcknowledgementLayout.read(big, AcknowledgementLayout.Number) == 0xfedcba98L)
    val little = RecordLayout.encode(
      RecordLayout.Sequence -> 0x1234,
      RecordLayout.Epoch    -> 0x56,
      RecordLayout.Time     -> 0xfedcba98L
    )
    assert(hex(little) == "3412005698badcfe")
    assert(RecordLayout.read(Array[Byte](9) ++ little, RecordLayout.Time, start = 1) == 0xfedcba98L)
  }

  "Records" should "be as long as the rules say" in {
    assert(ReportLayout.bytes == 24 && EventLayout.bytes == 16)            // REP-01
    assert(AcknowledgementLayout.bytes == 12 && CommandLayout.bytes == 32) // SRV-01, SRV-12
    assert(RecordLayout.bytes == 8 && AppendedLayout.bytes == 20)          // ALARM-03, AP-05
    assert(DatagramLayout.bytes == 10 && DatagramLayout.Overhead == 12)    // FP-12
  }

  /** The fields of a register stand where those of a layout do. */
  private def agree(register: Register, layout: Layout): Unit = assert(
    register.fields.sortBy(_.low).map(f => (f.low, f.width)) ==
      layout.fields.map(f => (8 * f.offset, 8 * f.bytes))
  )

  "A record at its register" should "be laid out as in the datagram" in
    agree(AlarmRegisters.all.find(_.address == AlarmRegisters.Record).get, RecordLayout)

  "An event of the host" should "be read where its registers are" in
    agree(MasterRegisters(Presets.master).find(_.address == MasterRegisters.HostEvent).get, HostEventLayout)

  "Every code" should "have a name and a number of its own" in {
    for (group <- Codes.all if group.name.nonEmpty)
      assert(group.all.map(_.value).distinct.size == group.all.size, group.name)
    assert(Command.all.map(_.value) == (0 to 14))
    assert(DetectorState.all.forall(_.value >> DetectorState.Width == 0))
  }
}
