package flyframe.registers

import org.scalatest.flatspec.AnyFlatSpec
import flyframe.params.Presets

class RegisterNamesSpec extends AnyFlatSpec {
  private val names = new RegisterNames(RegisterMap(Presets.allRegisters))

  "A field" should "be found with its register, its bytes and its bits there" in {
    val size = names.field("rx_fifo_size")
    assert(size.register == names.register("dl_control"))
    assert((size.byte, size.high, size.low) == ((0x0102, 2, 0)))
    assert(names.field("eeprom_command").byte == 0x0503)
    assert(names.field("confirm_life").bytes == (0x0eca to 0x0ecb))
    assert(names.has("sm7_enable") && !names.has("sm8_enable"))
  }

  private def refused(sentence: String)(what: => Any): Unit = {
    val told = intercept[IllegalArgumentException](what).getMessage
    assert(told.contains(sentence), told)
  }

  "A name that is in no table" should "be refused" in {
    refused("the field is called none but must be one of acknowledge_by_write,")(names.field("none"))
    refused("the register is called none but must be one of al_control,")(names.register("none"))
  }

  "A field of several bytes" should "not be taken for one of a byte" in
    refused("field al_status_code has bits 15 to 0 but must be within one byte.")(
      names.field("al_status_code").byte
    )
}
