package flyframe.registers

import java.nio.file.{Files, Paths}
import org.apache.commons.csv.CSVFormat
import scala.jdk.CollectionConverters._
import flyframe.params.EscParams

/** The register list of the reference, `docs/rules/slave-registers.csv`, against which [[RegisterMap]] is
  * checked. How to read its columns: `docs/rules/README.md`.
  */
object RegisterList {

  /** One field of a register of the list.
    *
    * @param bytes
    *   length of the register, if the list has a number for it
    * @param reset
    *   value of the field after a reset, if the list has one
    */
  private case class Row(
      address: Int,
      register: String,
      bytes: Option[Int],
      bits: Range,
      reserved: Boolean,
      ecat: String,
      pdi: String,
      reset: Option[BigInt],
      mandatory: Boolean
  )

  /** What a register, or a field of it, differs in from the list. */
  final case class Difference(name: String, text: String)

  private def number(hex: String): Option[BigInt] =
    "^0x([0-9A-Fa-f]+)".r.findFirstMatchIn(hex).map(m => BigInt(m.group(1), 16))

  /** Address formulas such as `0x0300+2*y` stand for all ports y, or all FMMUs or SyncManagers n. */
  private def addresses(formula: String): Seq[Int] = formula match {
    case s"0x$base+$stride*$unit" => units(base, stride.toInt, unit)
    case s"0x$base+$unit"         => units(base, 1, unit)
    case s"0x$base"               => Seq(Integer.parseInt(base, 16))
  }
  private def units(base: String, stride: Int, unit: String): Seq[Int] =
    (0 until (if (unit == "y") 4 else 16)).map(i => Integer.parseInt(base, 16) + stride * i)

  /** All rows below user RAM. */
  private val rows: Seq[Row] = {
    val format = CSVFormat.RFC4180.builder.setHeader().setSkipHeaderRecord(true).get()
    val reader = Files.newBufferedReader(Paths.get("docs/rules/slave-registers.csv"))
    val all =
      try format.parse(reader).getRecords.asScala.toSeq
      finally reader.close()
    for {
      r       <- all
      address <- addresses(r.get("address_hex")) if address < RegisterMap.UserRamStart
    } yield {
      val bits = r.get("bits") match {
        case s"$high:$low" => low.toInt to high.toInt
        case "all"         => 0 until 0
        case bit           => bit.toInt to bit.toInt
      }
      Row(
        address,
        r.get("register"),
        r.get("length_bytes").toIntOption,
        bits,
        r.get("field") == "reserved",
        r.get("ecat_access"),
        r.get("pdi_access"),
        number(r.get("reset_value")),
        r.get("presence") == "mandatory"
      )
    }
  }

  /** First addresses of the registers that every controller has. */
  val mandatory: Seq[Int] = rows.filter(r => r.mandatory && !r.reserved).map(_.address).distinct

  /** A code of the list as one of [[Access]]: brackets mean that a host which emulates the EEPROM may write.
    */
  private def access(code: String, p: EscParams): String = code match {
    case "r/(w)/[w]" => "r/(w)"
    case "r/[w]"     => if (p.hasEmulation) "r/(w)" else "r"
    case other       => other
  }

  /** What of `register` is not as the list has it. */
  def differences(register: Register, p: EscParams): Seq[Difference] = {
    val here    = rows.filter(_.address == register.address)
    def differs = Difference(register.name, _)
    if (here.isEmpty) Seq(differs("is not in the list"))
    else {
      val lengths = here.flatMap(_.bytes).distinct
      val fields  = here.filter(!_.reserved)
      def codes(of: Row => String, are: Access, side: String): Option[Difference] = {
        val listed = fields.map(row => access(of(row), p)).distinct
        Option.when(fields.nonEmpty && !listed.contains(are.code))(
          differs(s"$side access is ${are.code}, in the list ${listed.mkString(" and ")}")
        )
      }
      Option
        .when(!lengths.contains(register.bytes))(
          differs(s"has ${register.bytes} bytes, in the list ${lengths.mkString(" or ")}")
        )
        .toSeq ++ codes(_.ecat, register.ecat, "ECAT") ++ codes(_.pdi, register.pdi, "PDI") ++
        register.fields.flatMap(field(_, fields))
    }
  }

  /** Bits that the list does not have, and other reset values. */
  private def field(f: Field, listed: Seq[Row]): Seq[Difference] = {
    val bits = (f.low to f.high).map(bit => bit -> listed.filter(_.bits.contains(bit)))
    val resets = for {
      (bit, rows) <- bits
      listed = rows.flatMap(row => row.reset.map(_.testBit(bit - row.bits.start))).toSet
      if listed.nonEmpty && !listed(f.reset.testBit(bit - f.low))
    } yield bit
    Option.when(bits.exists(_._2.isEmpty))(Difference(f.name, "has bits that are none in the list")).toSeq ++
      Option.when(resets.nonEmpty)(
        Difference(f.name, s"is 0x${f.reset.toString(16)} after a reset, in the list another value")
      )
  }
}
