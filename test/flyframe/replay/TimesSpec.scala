package flyframe.replay

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.rules.Reply

/** What [[Times]] finds wrong about times that are not of the kind of those then. */
class TimesSpec extends AnyFlatSpec {
  private def reply(command: Int, ado: Int, words: Seq[Long]): Reply = {
    val data = words.flatMap(w => (0 to 3).map(i => (w >> 8 * i & 0xff).toInt))
    Reply(
      Seq(command, 0, 0, 0, ado & 0xff, ado >> 8, data.size, 0, 0, 0) ++ data ++ Seq(1, 0)
    )
  }
  private var frame = 0

  /** FPRD of these words from slave `slave`, then and now. */
  private def read(slave: Int, ado: Int, recorded: Seq[Long], actual: Seq[Long]) = {
    frame += 1
    Addressed(frame, 0, reply(4, ado, recorded), Set(slave)) -> reply(4, ado, actual)
  }
  private def write(ado: Int) = {
    frame += 1
    Addressed(frame, 0, reply(8, ado, Seq(0L)), Set(0, 1)) -> reply(8, ado, Seq(0L))
  }
  private def wrong(datagrams: (Addressed, Reply)*): Int = Times.check(datagrams).wrong.size

  "Receive times" should "have come back behind the ports where they came back then" in {
    def first(actual: Long*) =
      wrong(write(0x0900), read(0, 0x0900, Seq(1000L, 1600L, 0L, 0x66666666L), actual))
    assert(first(5000, 7000, 0, 0) == 0)
    assert(first(5000, 0, 0, 0) == 1, "not there")
    assert(first(5000, 4000, 0, 0) == 2, "before it began, and not there")
    assert(first(5000, 7000, 8000, 0) == 1, "behind a port without a slave")
    assert(first(5000, 7000, 0, 1) == 1)
    assert(first(0xfffffff0L, 200, 0, 0) == 0, "the count begins anew")
  }
  they should "get less along a line" in {
    def line(far: Long) = wrong(
      write(0x0900),
      read(0, 0x0900, Seq(1000L, 1600L), Seq(5000L, 7000L)),
      read(1, 0x0900, Seq(9000L, 9310L), Seq(3000L, 3000L + far))
    )
    assert(line(1000) == 0 && line(3000) == 1)
  }
  they should "be that of port 0 at the processing unit, if they were" in {
    def unit(of: Long) = wrong(
      write(0x0900),
      read(0, 0x0900, Seq(1000L), Seq(5000L)),
      read(0, 0x0918, Seq(1000L), Seq(of))
    )
    assert(unit(5000) == 0 && unit(5010) == 1)
  }
  "The system time" should "go on, and no faster than it did" in {
    def second(then: Long, now: Long, between: (Addressed, Reply)*) = wrong(
      (read(0, 0x0910, Seq(1000L), Seq(77000L)) +: between) :+ read(0, 0x0910, Seq(then), Seq(now)): _*
    )
    assert(second(1001000, 90000) == 0 && second(1001000, 1077000) == 0)
    assert(second(1001000, 77000) == 1, "it stands")
    assert(second(1001000, 76000) == 1, "it goes back")
    assert(second(1001000, 1177000) == 1, "it goes too fast")
    assert(second(1001000, 76000, write(0x0920)) == 0, "it has been set")
  }
  "The difference" should "be none where it was none" in {
    assert(wrong(read(0, 0x092c, Seq(0L), Seq(0L))) == 0)
    assert(wrong(read(0, 0x092c, Seq(0L), Seq(3L))) == 1)
    assert(wrong(read(1, 0x092c, Seq(0xfdL), Seq(0x80000012L))) == 0)
    assert(wrong(read(1, 0x092c, Seq(0xfdL), Seq(0L))) == 1)
  }
  "Other registers" should "be no times" in {
    for (address <- Seq(0x08ff, 0x0920, 0x0928, 0x0930, 0x0981)) assert(!Times.isTime(address))
    for (address <- Seq(0x0900, 0x090f, 0x0910, 0x0917, 0x091f, 0x092c, 0x092f))
      assert(Times.isTime(address))
  }
}
