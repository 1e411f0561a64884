package flyframe.model

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.EscParams
import flyframe.protocol.Command.Apwr

/** AL, watchdogs and SII of the model, where the rule tests cannot reach: emulation, EEPROM and time. */
class ApplicationModelSpec extends AnyFlatSpec {
  private val p = EscParams(
    ramKiB = 1,
    fmmus = 8,
    syncManagers = 8,
    applicationLayer = 1,
    watchdogs = 1,
    leds = 1,
    sii = 1
  )

  /** An EEPROM of 2 KiB with this configuration area. */
  private def image(start: Int*): Vector[Int] = {
    val area = start.padTo(14, 0)
    (area ++ Seq(SiiModel.checksum(area), 0) ++ (16 until 2048).map(_ & 0xff)).toVector
  }
  private def send(m: EscModel, datagrams: Datagram*): Seq[Int] =
    m.receive(0, WireFrame.withFcs(EtherCatFrame(datagrams))).get._2.bytes
  private def write(m: EscModel, address: Int, data: Int*): Boolean =
    send(m, Datagram(Apwr, 0, address, data))(26 + data.size) == 1

  "AL-05: with emulation AL status" should "follow AL control, bit 4 included, which stays open" in {
    val m = new EscModel(p, Some(image(0x00, 0x01)))
    for (state <- Seq(2, 4, 8, 0x14, 1)) {
      assert(write(m, 0x0120, state, 0))
      assert(m.hostRead(0x0130) == state && (m.hostRead(0x0220) & 1) == 0)
    }
    assert((m.hostRead(0x0210) & 8) == 8)
    m.hostWrite(0x0130, 4)
    assert(m.hostRead(0x0130) == 1, "not by the host")
  }
  "AL-04, AL-06: without emulation AL status" should "be the host's" in {
    val m = new EscModel(p, Some(image()))
    assert(write(m, 0x0120, 2) && !write(m, 0x0120, 4))
    m.hostWrite(0x0130, 2)
    assert(m.hostRead(0x0130) == 2 && (m.hostRead(0x0210) & 8) == 8)
    assert(m.interrupt && m.hostRead(0x0120) == 2 && !m.interrupt)
  }
  "IRQ-08, B-42: events of AL status" should "count any change, even there and back in one frame" in {
    val m = new EscModel(p, Some(image(0x00, 0x01)))
    send(m, Datagram(Apwr, 0, 0x0120, Seq(2)), Datagram(Apwr, 0, 0x0120, Seq(1)))
    assert(m.hostRead(0x0130) == 1 && (m.hostRead(0x0210) & 8) == 8)
  }
  "WD-01, WD-02: a watchdog" should "expire at tick number time + 1" in {
    var expired = 0
    val dog     = new Watchdog(() => 3, () => expired += 1)
    dog.tick(100)
    assert(expired == 0 && !dog.alive, "expired from the start, without having counted")
    dog.trigger()
    dog.tick(3)
    assert(dog.alive && expired == 0)
    dog.tick(1)
    assert(!dog.alive && expired == 1)
    dog.tick(10)
    assert(expired == 1)
  }
  "WD-03, WD-05, WD-06, WD-09, B-62: the watchdog registers" should "work" in {
    val m = new EscModel(p, Some(image()))
    assert(m.hostRead(0x0448) == 0 && m.hostRead(0x0448) == 1, "a host access triggers when it ends")
    assert(m.hostRead(0x0440) == 0)
    assert(write(m, 0x0420, 10, 0))
    m.advanceMs(2)
    assert(m.hostRead(0x0442) == 0 && m.hostRead(0x0440) == 0, "B-61: never triggered, never expired")
    assert(write(m, 0x0800, 0x00, 0x10, 2, 0, 0x44, 0, 1) && write(m, 0x1000, 1, 2))
    assert(m.hostRead(0x0440) == 1)
    m.advanceMs(2)
    assert(m.hostRead(0x0442) == 1 && (m.hostRead(0x0220) & 0x40) == 0x40)
    m.hostRead(0x0440)
    assert((m.hostRead(0x0220) & 0x40) == 0)
    m.advanceMs(200)
    assert((m.hostRead(0x0110) & 2) == 0 && (m.hostRead(0x0110) & 2) == 2 && m.hostRead(0x0443) == 1)
    assert(write(m, 0x0443, 0) && m.hostRead(0x0442) == 0 && m.hostRead(0x0443) == 0)
    assert(write(m, 0x0420, 0, 0) && m.hostRead(0x0440) == 1, "off")
  }
  "SII-01, SII-02: the checksum" should "match the vectors" in {
    def of(start: Int*) = SiiModel.checksum(start.padTo(14, 0))
    assert(of(0x00, 0x0d) == 0x46 && of(0x04, 0x01, 0, 0, 0, 0, 0x0f) == 0xd8 && of() == 0x30)
    assert(of(0x80, 0x03, 0x00, 0x6e, 0xff, 0x00, 0xff) == 0x22 && of(5, 0xe, 3, 6, 0x10, 0x27) == 0xd7)
    assert(SiiModel.checksum(Seq.fill(14)(0xff)) == 0xa3)
  }
  "SII-06, SII-07: the configuration area" should "be taken only with a right checksum" in {
    val good = new EscModel(p, Some(image(0x08, 0x0c, 0x01, 0x02, 0, 0, 0, 0, 0x34, 0x12)))
    assert((good.hostRead(0x0110) & 1) == 1 && good.hostRead(0x0140) == 0x08 && good.hostRead(0x0141) == 0x0c)
    assert(good.hostRead(0x0150) == 1 && good.hostRead(0x0151) == 2)
    assert(good.hostRead(0x0012) == 0x34 && good.hostRead(0x0013) == 0x12)
    val bad = new EscModel(p, Some(image(0x08).updated(14, 0)))
    assert((bad.hostRead(0x0110) & 1) == 0 && (bad.hostRead(0x0503) & 0x18) == 0x18)
  }
  "SII-10, SII-11: the interface" should "belong to ECAT until it is offered or taken" in {
    val m = new EscModel(p, Some(image()))
    m.hostWrite(0x0501, 1)
    assert(m.hostRead(0x0501) == 0 && write(m, 0x0504, 1))
    m.hostWrite(0x0504, 7)
    assert(m.hostRead(0x0504) == 1)
    assert(write(m, 0x0500, 1) && !write(m, 0x0504, 2))
    m.hostWrite(0x0501, 1)
    assert(write(m, 0x0500, 0) && !write(m, 0x0504, 2), "the PDI still has it")
    assert(write(m, 0x0500, 2) && m.hostRead(0x0501) == 0 && write(m, 0x0500, 0) && write(m, 0x0504, 2))
  }
  "SII-12 to SII-15: commands" should "read, write with enable, and report errors" in {
    val m = new EscModel(p, Some(image()))
    assert(write(m, 0x0502, 0, 1, 0x10, 0, 0, 0), "command and address in one frame")
    assert((0 to 7).map(i => m.hostRead(0x0508 + i)) == (0x20 to 0x27))
    assert(write(m, 0x0508, 0xaa, 0x55) && write(m, 0x0502, 0, 2))
    assert((m.hostRead(0x0503) & 0x40) == 0x40, "no write enable")
    assert(write(m, 0x0502, 1, 2) && (m.hostRead(0x0503) & 0x60) == 0)
    assert(write(m, 0x0508, 0, 0) && write(m, 0x0502, 0, 1) && m.hostRead(0x0508) == 0xaa)
    assert(write(m, 0x0502, 0, 5) && (m.hostRead(0x0503) & 0x20) == 0x20, "no such command")
    assert(write(m, 0x0502, 0, 0) && (m.hostRead(0x0503) & 0x20) == 0)
  }
}
