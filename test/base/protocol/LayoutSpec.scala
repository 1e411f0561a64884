package flyframe.protocol

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.Presets
import flyframe.registers.{AlarmRegisters, MasterRegisters, Register}

class LayoutSpec extends AnyFlatSpec {
  private def hex(bytes: Array[Byte]) = bytes.map(b => f"$b%02x").mkString

  "A layout" should "put numbers where its fields are, in its order, and read them again" in {
    val big = AnswerLayout.encode(
      AnswerLayout.Magic  -> 0x4641,
      AnswerLayout.Master -> 0x1234,
      AnswerLayout.Life   -> 0xfedcba9876543210L
    )
    assert(hex(big.take(16)) == "4641000012340000fedcba9876543210")
    assert(AnswerLayout.read(big, AnswerLayout.Life) == 0xfedcba9876543210L)
    val little = RecordLayout.encode(
      RecordLayout.Sequence -> 0x1234,
      RecordLayout.Epoch    -> 0x56,
      RecordLayout.Time     -> 0xfedcba98L
    )
    assert(hex(little) == "3412005698badcfe00000000")
    assert(RecordLayout.read(Array[Byte](9) ++ little, RecordLayout.Time, start = 1) == 0xfedcba98L)
  }

  "Records" should "be as long as the rules say" in {
    assert(ReportLayout.bytes == 56 && ReportedSlaveLayout.bytes == 4)  // REP-01
    assert(EventLayout.bytes == 24 && ReportEndLayout.bytes == 34)      // REP-01
    assert(AnswerLayout.bytes == 64 && NonceLayout.bytes == 16)         // SRV-01
    assert(RecordLayout.bytes == 12 && AppendedLayout.bytes == 24)      // ALARM-03, AP-05
    assert(RecordAckLayout.bytes == 6 && ConfirmLayout.bytes == 4)      // ALARM-04, ALARM-05
    assert(SlaveStateLayout.bytes == 8)                                 // ALARM-10
    assert(DatagramLayout.bytes == 10 && DatagramLayout.Overhead == 12) // FP-12
  }

  /** The fields of a register stand where those of a layout do. */
  private def agree(register: Register, layout: Layout): Unit = assert(
    register.fields.sortBy(_.low).map(f => (f.low, f.width)) ==
      layout.fields.map(f => (8 * f.offset, 8 * f.bytes))
  )

  "What the master reads and writes at a slave" should "be laid out as the registers are" in
    Seq(
      AlarmRegisters.State       -> SlaveStateLayout,
      AlarmRegisters.Acknowledge -> RecordAckLayout,
      AlarmRegisters.Confirm     -> ConfirmLayout
    ).foreach { case (address, layout) => agree(AlarmRegisters.all.find(_.address == address).get, layout) }

  "An event of the host" should "be read where its registers are" in
    agree(MasterRegisters(Presets.master).find(_.address == MasterRegisters.HostEvent).get, HostEventLayout)

  "Every code" should "have a name and a number of its own" in {
    for (group <- Codes.all if group.name.nonEmpty)
      assert(group.all.map(_.value).distinct.size == group.all.size, group.name)
    assert(Command.all.map(_.value) == (0 to 14))
    val states = DetectorState.all.map(_.value).filter(_ != DetectorState.Test)
    assert(states.forall(_ >> DetectorState.Width == 0))
  }
}
