package flyframe.server

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.protocol.{EventKind, ServerDatagram}

/** The commands to one master, with counters that a log does not reach in a test. */
class CommandsSpec extends AnyFlatSpec {
  private val life = Life(1, 10)

  "SRV-13: a command" should "be known by the low 16 bits of its counter, however high that is" in {
    for (counter <- Seq(1L, 0xffffL, 0x10000L, 0x10001L, 0x1ffffL, 0xfffffffeL)) {
      val commands = new Commands(new Array[Byte](32), 100, 3, _ => counter)
      def tell(number: Long): Unit = commands.told(
        life,
        Event(EventKind.Command, ServerDatagram.AlarmClear, ServerDatagram.AllNodes, (number & 0xffff).toInt)
      )
      assert(commands.add(life, ServerDatagram.AlarmClear, ServerDatagram.AllNodes).isRight)
      assert(commands.tick(0)._1.nonEmpty && commands.all.head.counter.contains(counter))
      tell(counter - 1)
      tell(counter + 1)
      assert(commands.all.head.outcome.isEmpty, counter)
      tell(counter)
      assert(commands.all.head.outcome.contains(Right(())), counter)
    }
  }
}
