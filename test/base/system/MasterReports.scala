package flyframe.system

import flyframe.protocol._

/** An event of a master (EventLayout). */
final case class Event(
    kind: Int,
    position: Int,
    node: Int,
    sequence: Int,
    state: Int,
    epoch: Int,
    slaveTime: Long,
    masterTime: Long
)

/** State of a slave in a report (ReportedSlaveLayout). */
final case class ReportedSlave(status: Int, node: Int)

/** A report (ReportLayout) before its tag is made. */
final case class Report(
    master: Int,
    life: Long,
    server: Long,
    counter: Int,
    number: Int,
    time: Long,
    status: Int,
    lost: Int,
    present: Int,
    cut: Int,
    refused: Int,
    slaves: Seq[ReportedSlave],
    events: Seq[Event]
)

/** An answer of the server (AnswerLayout).
  *
  * @param genuine
  *   its tag is right
  * @param trouble
  *   the server cannot write its log
  */
final case class Answer(
    genuine: Boolean,
    life: Long,
    server: Long,
    echo: Int,
    number: Int,
    trouble: Boolean = false,
    ticket: Int = 0,
    order: Int = Order.None,
    node: Int = ServerDatagram.AllNodes
)
