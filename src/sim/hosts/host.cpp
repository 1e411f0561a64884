#include "hosts/host.h"

#include <algorithm>

#include "core/user_error.h"

namespace hosts {

void WordHost::read(unsigned address, uint8_t* data, unsigned length) {
  while (length > 0) {
    const unsigned lane = address % lanes(), bytes = std::min(length, lanes() - lane);
    const uint32_t word = access(false, wordOf(address), 0, ((1u << bytes) - 1) << lane);
    for (unsigned i = 0; i < bytes; ++i) data[i] = static_cast<uint8_t>(word >> (8 * (lane + i)));
    address += bytes, data += bytes, length -= bytes;
  }
}

void WordHost::write(unsigned address, const uint8_t* data, unsigned length) {
  while (length > 0) {
    const unsigned lane = address % lanes(), bytes = std::min(length, lanes() - lane);
    // Bytes that are not enabled are anything.
    uint32_t word = static_cast<uint32_t>(random_.below(0x10000)) * 0x10001u;
    for (unsigned i = 0; i < bytes; ++i) {
      word &= ~(0xffu << (8 * (lane + i)));
      word |= static_cast<uint32_t>(data[i]) << (8 * (lane + i));
    }
    access(true, wordOf(address), word, ((1u << bytes) - 1) << lane);
    address += bytes, data += bytes, length -= bytes;
  }
}

std::unique_ptr<Host> makeHost(Core& core, Random& random) {
  std::unique_ptr<Host> host;
  switch (core.parameter("hostInterface")) {
    case 0: host = makePort(core, random); break;
    case 1: host = makeAvalon(core, random); break;
    case 2: host = makeAxiLite(core, random); break;
    case 3: host = makeWishbone(core, random); break;
    case 4: host = makeSpi(core, random); break;
    case 5: host = makeMicrocontroller(core, random); break;
    default: throw UserError("the preset '" + core.info().name + "' has no host.");
  }
  // In reset, then until the core has cleared its register RAM and taken the link.
  *core.pins().reset = 1;
  host->rest();
  core.cycle(20);
  *core.pins().reset = 0;
  core.cycle(2000);
  return host;
}

}  // namespace hosts
