package flyframe.e2e

import java.nio.file.{Files, Path}
import scala.util.Using
import org.scalatest.flatspec.AnyFlatSpec
import flyframe.server.{Life, ModelGateway, ServerBench}

/** Rings on the server's page, in headless Chromium. Screenshots: build/page. */
class RingOnPageSpec extends AnyFlatSpec {
  import ServerBench.{eventually, withServer}
  private val Size                                = 51
  private def hello(ports: Int, d1: Int, d2: Int) = Seq(1, 9, 0, ports, 0, 0, 0, 7, 2, d1, d2)

  /** A ring of 51 nodes; they lie by their distances, not by their addresses. */
  private val order = 1 +: (2 to Size).sortBy(a => a * 37 % 53)
  private def whole(gateway: ModelGateway): Unit = {
    for ((address, i) <- order.zipWithIndex)
      gateway.node(address, (if (i == 0) hello(0x44, 0, 0) else hello(0x44, Size - i, i)): _*)
    gateway.ring(0, 0)
    gateway.settle()
  }

  "GW-07: the page" should "draw the ring, its break, a dead node, and urgent messages" in withServer() {
    server =>
      Using.resource(new ModelGateway(Life(3, 1), server.udpPort)) { gateway =>
        whole(gateway)
        Using.resource(new Browser(server.page)) { browser =>
          def states = browser.attributes(".picture g", "class").map(_.takeWhile(_ != ' '))
          def labels = browser.texts(".picture g text").map(_.toInt)
          def shot(name: String): Unit = {
            Files.createDirectories(Path.of("build/page"))
            browser.screenshot(Path.of(s"build/page/$name.png"))
          }
          browser.size(1280, 1000)
          eventually("the ring is drawn")(labels.size == Size)
          assert(labels == order && states.forall(_ == "normal"))
          assert(browser.attributes(".picture .is-cut", "x1").isEmpty)
          assert(browser.texts(".ring .bar .state").map(_.toLowerCase) == Seq("ring whole"))

          // Node at place 20 dies: its neighbours have a port down.
          val (left, dead, right) = (order(19), order(20), order(21))
          for ((address, i) <- order.zipWithIndex.drop(1)) {
            val ports = if (address == left) 0x04 else if (address == right) 0x40 else 0x44
            if (address == dead) gateway.node(address, 0)
            else if (i < 20) gateway.node(address, hello(ports, 0, i): _*)
            else gateway.node(address, hello(ports, Size - i, 0): _*)
          }
          gateway.ring(left, right)
          gateway.message(left, 0, 0, "power failure".getBytes.toSeq, urgent = true)
          gateway.message(right, 0, 0, Seq[Byte](0, 1, 2))
          gateway.settle()
          eventually("the dead node is shown")(states.count(_ == "lost") == 1)
          assert(labels == order, "it stays where it was")
          assert(states.zip(order).filter(_._1 != "normal").map(_._2).toSet == Set(left, dead, right))
          assert(browser.attributes(".picture .is-cut", "x1").size == 2)
          assert(browser.texts(".picture .cut-mark") == Seq("✂", "✂"))
          assert(
            browser.texts(".nodes li").toSet == Set(
              s"node $left: port 2 down",
              s"node $dead: lost",
              s"node $right: port 1 down"
            )
          )
          assert(browser.attributes(".ring", "class").head.contains("is-broken"))
          val first = browser.attributes(".picture", "aria-label").head
          assert(first == s"Ring of $Size nodes: ring broken between node $left and node $right")
          assert(browser.log.exists(l => l.contains("urgent message") && l.contains("“power failure”")))
          assert(browser.attributes("#log tr.alarm", "data-id").size == 1)
          val drawn = Seq("normal", "fault", "lost").map(s =>
            browser.script(s"return document.querySelector('#shape-$s').innerHTML").toString
          )
          assert(drawn.distinct.size == 3, "each state has a shape of its own")
          shot("ring")
          for (width <- Seq(1280, 400)) {
            browser.size(width, 1000)
            eventually(s"nothing is wider than $width pixels") {
              browser.script("return document.documentElement.scrollWidth").toString.toInt <= width
            }
            eventually("the picture fits") {
              browser.attributes(".picture", "viewBox").head.split(' ')(2).toInt <= width && labels == order
            }
          }
          shot("ring-narrow")

          // A message to a node.
          browser.size(1280, 1000)
          browser.script("document.querySelector('.ring details').open = true")
          browser.script(s"document.querySelector('.ring .to').value = '$left'")
          browser.script("document.querySelector('.ring .text').value = 'all clear'")
          browser.script("document.querySelector('.ring form button').click()")
          eventually("the gateway has it") {
            gateway.report()
            gateway.listen(20)
            gateway.sends.map(s => new String(s.data.toArray)) == Seq("all clear")
          }
          gateway.settle()
          eventually("its result is shown")(
            browser.texts(".ring .orders li") == Seq(s"Message to node $left: “all clear”: delivered")
          )
          assert(gateway.sends.head.destination == left && !gateway.sends.head.urgent)
        }
      }
  }

  it should "keep urgent messages in sight, draw no cut where none is, and a text until it is taken" in
    withServer() { server =>
      Using.resource(new ModelGateway(Life(3, 1), server.udpPort)) { gateway =>
        whole(gateway)
        Using.resource(new Browser(server.page)) { browser =>
          def value(of: String, property: String = "textContent") =
            browser.script(s"return document.querySelector('$of').$property").toString
          def title = browser.script("return document.title").toString
          def calls = browser.texts(".ring .calls li")
          browser.size(1280, 1000)
          eventually("the ring is drawn")(browser.texts(".picture g text").size == Size)

          // Its host is dead, its controller relays.
          gateway.node(order(20), 0)
          gateway.settle()
          eventually("it is lost")(browser.texts(".nodes li") == Seq(s"node ${order(20)}: lost"))
          assert(browser.texts(".picture g text").map(_.toInt) == order)
          assert(browser.attributes(".picture .is-cut", "x1").isEmpty && browser.texts(".cut-mark").isEmpty)

          assert(title == "flyframe fibre ring" && calls.isEmpty)
          gateway.message(5, 0, 0, "door open".getBytes.toSeq, urgent = true)
          gateway.settle()
          eventually("it is announced")(value("#news").contains("node 5: “door open”"))
          eventually("it is in the title")(title == "▲ urgent message – flyframe fibre ring")
          for (i <- 1 to 250) gateway.message(6, i % 15, i / 15, s"normal $i".getBytes.toSeq)
          gateway.settle()
          eventually("the log has all")(browser.log.headOption.exists(_.contains("normal 250")))
          assert(!browser.log.exists(_.contains("door open")))
          assert(calls.size == 1 && calls.head.endsWith("urgent message of node 5: “door open”"))
          browser.script("dispatchEvent(new Event('pointerdown'))")
          assert(title == "flyframe fibre ring" && calls.size == 1)
          browser.script("location.reload()")
          eventually("it is there when the page is opened")(calls.size == 1)
          assert(title == "flyframe fibre ring")

          // A text of 600 characters may be too long.
          def send(text: String): Unit = {
            browser.script(s"document.querySelector('.ring .text').value = '$text'")
            browser.script("document.querySelector('.ring form button').click()")
          }
          eventually("messages can be sent")(
            browser.script("return !document.querySelector('.ring form button').disabled") == true
          )
          send("ü" * 600)
          eventually("why it is not sent is said")(
            value("#message") == "The message has 1200 bytes, but must have 1 to 1024."
          )
          assert(value(".ring .text", "value") == "ü" * 600)
          send("all clear")
          eventually("the field is empty")(value(".ring .text", "value").isEmpty)
        }
      }
    }
}
