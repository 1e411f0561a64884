package flyframe.registers

import flyframe.params.CanParams
import org.scalatest.flatspec.AnyFlatSpec

/** The registers of ports and both modes, beside those of the CAN ports. */
class RingRegistersSpec extends AnyFlatSpec {
  private val all =
    (RingRegisters(addressBits = 7, hasRelay = true) ++ RingRegisters.relay).sortBy(_.address)

  "The registers of a ring node" should "not overlap, nor reach into those of the CAN ports" in {
    for ((a, b) <- all.zip(all.drop(1))) assert(a.address + a.bytes <= b.address, (a.name, b.name))
    assert(all.last.range.last < CanRegisters(0, CanParams()).head.address)
  }

  they should "have names of their own, and fields that do not overlap" in {
    new RegisterNames(all)
    val names = all.flatMap(_.fields.map(_.name))
    assert(names.distinct == names)
    for (r <- all) assert(r.fields.map(_.mask).sum == r.mask, r.name)
  }
}
