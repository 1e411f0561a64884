package flyframe.server

import org.apache.commons.csv.{CSVFormat, CSVPrinter}

/** The log as CSV (RFC 4180), times in UTC (SRV-16). */
object LogCsv {
  private def columns(expected: Expected) = Seq[(String, LogEntry => Any)](
    "received_utc" -> (_.received),
    "master"       -> (_.life.master),
    "life"         -> (_.life.hex),
    "number"       -> (_.number),
    "detector"     -> (e => EventText.position(e.event).fold("")(expected.label(e.life.master, _))),
    "zone" -> (e => EventText.position(e.event).flatMap(expected.slave(e.life.master, _)).fold("")(_.zone)),
    "node" -> (e => EventText.node(e.event).getOrElse("")),
    "text" -> (_.text),
    "kind" -> (_.event.kind),
    "position"       -> (_.event.position),
    "sequence"       -> (_.event.sequence),
    "state"          -> (_.event.state),
    "epoch"          -> (_.event.epoch),
    "slave_time_us"  -> (_.event.slaveTime),
    "master_time_us" -> (_.event.masterTime)
  )

  /** Writes all entries; `after` gives those behind an ID, in portions. */
  def write(out: Appendable, expected: Expected, after: Long => Seq[LogEntry]): Unit = {
    val printer = new CSVPrinter(out, CSVFormat.RFC4180)
    val fields  = columns(expected)
    printer.printRecord(fields.map(_._1): _*)
    Iterator
      .unfold(0L)(id => Option(after(id)).filter(_.nonEmpty).map(entries => (entries, entries.last.id)))
      .flatten
      .foreach(entry =>
        printer.printRecord(fields.map { case (_, field) => harmless(field(entry).toString) }: _*)
      )
    printer.flush()
  }

  /** A text that a spreadsheet does not take for a formula. */
  def harmless(text: String): String =
    if (text.headOption.exists("=+-@\t\r\n|".contains(_))) s"'$text" else text
}
