package flyframe.registers

import flyframe.params.CanParams
import org.scalatest.flatspec.AnyFlatSpec

/** The registers of both CAN ports, side by side. */
class CanRegistersSpec extends AnyFlatSpec {
  private val both = Seq(0, 1).flatMap(CanRegisters(_, CanParams(filters = 32))).sortBy(_.address)

  "The registers of both ports" should "lie where the register map has room for them" in {
    for ((a, b)        <- both.zip(both.drop(1))) assert(a.address + a.bytes <= b.address, (a.name, b.name))
    for ((start, port) <- CanRegisters.PortStarts.zip(CanRegisters.Ports)) {
      val own = both.filter(r => r.name.startsWith(port) && r.address < CanRegisters.SlotStarts.head)
      assert(own.head.address == start && own.last.range.last == start + 0x3f)
    }
    assert(both.last.range.last == 0x07ff)
  }

  they should "have names of their own" in {
    new RegisterNames(both)
    val names = both.flatMap(_.fields.map(_.name))
    assert(names.distinct == names)
  }

  they should "have fields that do not overlap" in {
    for (r <- both) assert(r.fields.map(_.mask).sum == r.mask, r.name)
  }

  "A frame in a slot" should "be laid out as one received" in {
    def layout(name: String) = {
      val r = both.find(_.name == name).get
      r.fields.map(f => f.name.stripPrefix(name.stripSuffix("frame")).stripPrefix("_") -> f.mask).toMap
    }
    assert(layout("can_f_rx_frame") - "filter" == layout("can_f_slot3"))
  }
}
