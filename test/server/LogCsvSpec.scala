package flyframe.server

import java.io.StringReader
import java.time.Instant
import org.apache.commons.csv.CSVFormat
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.EventKind
import scala.jdk.CollectionConverters._

class LogCsvSpec extends AnyFlatSpec {
  private def written(entries: LogEntry*): String = {
    val out = new java.lang.StringBuilder
    LogCsv.write(out, expected, id => entries.filter(_.id > id).take(2))
    out.toString
  }
  private val expected = Expected(
    Map(1 -> Vector.fill(3)(ExpectedSlave(9, "x", "")).appended(ExpectedSlave(4, "K4", "Hall")))
  )
  private val now                       = Instant.parse("2026-01-02T03:04:05.678Z")
  private def entry(id: Long, e: Event) = LogEntry(id, now.plusMillis(id), Life(1, 0xabcL), id - 1, e)

  "SRV-16: CSV" should "have a line of names, then all entries, times in UTC, ended by CR LF" in {
    val text = written(
      entry(1, Event(EventKind.Detector, 3, 4, 5, 2, 6, 0x123456789abL, 8)),
      entry(2, Event(EventKind.Line, 5, 0, 4)),
      entry(3, Event(EventKind.Command, 2, 4, 1, 0))
    )
    assert(
      text ==
        "received_utc,master,life,number,detector,zone,node,text,kind,position,sequence,state,epoch," +
        "slave_time_us,master_time_us\r\n" +
        "2026-01-02T03:04:05.679Z,1,0000000000000abc,0,K4,Hall,4,alarm,1,3,5,2,6,1250999896491,8\r\n" +
        "2026-01-02T03:04:05.680Z,1,0000000000000abc,1,,,,\"master: smoke now, slaves that answer: 5\"," +
        "3,5,4,0,0,0,0\r\n" +
        "2026-01-02T03:04:05.681Z,1,0000000000000abc,2,,,4,reset ID 4: done,4,2,1,0,0,0,0\r\n"
    )
  }

  it should "be read back by a CSV reader, every field in its column" in {
    val events = (1 to 5).map(kind => Event(kind, 1, 2, 3, 4, 5, 6, 7))
    val text   = written(events.zipWithIndex.map { case (e, i) => entry(i + 1L, e) }: _*)
    val records = CSVFormat.RFC4180.builder
      .setHeader()
      .setSkipHeaderRecord(true)
      .get
      .parse(new StringReader(text))
      .asScala
      .toSeq
    assert(records.map(_.get("text")) == events.map(EventText.text))
    assert(records.map(_.get("master_time_us")).forall(_ == "7"))
  }

  "SRV-16: a field" should "not be taken for a formula" in {
    for (text <- Seq("=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "|calc"))
      assert(LogCsv.harmless(text) == s"'$text")
    for (text <- Seq("", "alarm", "1A", "a=1", "2026-01-02")) assert(LogCsv.harmless(text) == text)
  }
}
