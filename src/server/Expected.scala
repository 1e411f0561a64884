package flyframe.server

import java.nio.file.{Files, Path}
import scala.util.Try
import flyframe.protocol.ServerDatagram

/** A slave as it is to be.
  *
  * @param node
  *   its ID; 0: an ordinary EtherCAT slave
  * @param label
  *   what is written on its detector
  * @param zone
  *   where it is; may be empty
  */
final case class ExpectedSlave(node: Int, label: String, zone: String)

/** The slaves of each master as they are to be, by master ID and position (SRV-20).
  *
  * @param masters
  *   only those in the list of expected slaves
  */
final case class Expected(masters: Map[Int, Vector[ExpectedSlave]] = Map.empty) {

  /** The slave that is to be at a position. */
  def slave(master: Int, position: Int): Option[ExpectedSlave] = masters.get(master).flatMap(_.lift(position))

  /** What is written on the detector at a position. */
  def label(master: Int, position: Int): String =
    slave(master, position).fold(Expected.label(position))(_.label)

  /** The zones of a master that have a name, with the node IDs of their alarm slaves, in the order of the
    * list.
    */
  def zones(master: Int): Seq[(String, Seq[Int])] = {
    val slaves = masters.getOrElse(master, Vector.empty).filter(s => s.node != 0 && s.zone.nonEmpty)
    slaves.map(_.zone).distinct.map(zone => zone -> slaves.filter(_.zone == zone).map(_.node))
  }
}

object Expected {

  /** A label where there is no list: 1A, 1B, 2A, ... */
  def label(position: Int): String = s"${position / 2 + 1}${if (position % 2 == 0) "A" else "B"}"

  private val MostSlaves = 255

  /** The list in a JSON file; Left: what is wrong with it, in one sentence. */
  def read(path: Path): Either[String, Expected] = for {
    text <- Try(Files.readString(path)).toEither.left.map(_ => s"The list of slaves $path cannot be read.")
    json <- Try(ujson.read(text)).toEither.left.map(_ => s"The list of slaves $path is not JSON.")
    list <- Try(parse(json)).toEither.left.map(e => s"The list of slaves $path is wrong: ${sentence(e)}")
  } yield list

  private def sentence(e: Throwable): String = e match {
    case wrong: IllegalArgumentException => wrong.getMessage.stripPrefix("requirement failed: ")
    case _ => """it must be {"masters": [{"id": 1, "expected": [{"node": 1, "label": "1A", "zone": ""}]}]}."""
  }

  private def parse(json: ujson.Value): Expected = {
    only("The list", json, "masters")
    val masters = json("masters").arr.toVector.map { m =>
      only("A master", m, "id", "expected")
      val id     = number(m("id"), "id", 0xffff)
      val slaves = m("expected").arr.toVector.zipWithIndex.map { case (s, i) => slave(id, s, i) }
      require(slaves.size <= MostSlaves, s"master $id has more than $MostSlaves slaves.")
      val nodes = slaves.map(_.node).filter(_ != 0).map(_.toString)
      for ((what, values) <- Seq("node" -> nodes, "label" -> slaves.map(_.label)))
        values.diff(values.distinct).foreach(v => require(false, s"master $id has the $what $v twice."))
      id -> slaves
    }
    masters
      .map(_._1)
      .diff(masters.map(_._1).distinct)
      .foreach(id => require(false, s"master $id is there twice."))
    require(
      masters.size <= Supervisor.MostMasters,
      s"it has more than ${Supervisor.MostMasters} masters."
    )
    Expected(masters.toMap)
  }

  private def slave(master: Int, json: ujson.Value, position: Int): ExpectedSlave = {
    only(s"A slave of master $master", json, "node", "label", "zone")
    val node = number(json("node"), "node", ServerDatagram.AllNodes - 1)
    ExpectedSlave(
      node,
      json.obj.get("label").fold(label(position))(_.str),
      json.obj.get("zone").fold("")(_.str)
    )
  }

  /** A misspelt name must not be ignored. */
  private def only(what: String, json: ujson.Value, names: String*): Unit =
    json.obj.keys.find(!names.contains(_)).foreach(k => require(false, s"$what has an unknown field '$k'."))

  private def number(json: ujson.Value, name: String, most: Int): Int = {
    val n = json.num
    require(n.isWhole && n >= 0 && n <= most, s"$name is $n but must be a whole number up to $most.")
    n.toInt
  }
}
