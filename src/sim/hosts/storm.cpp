#include <cinttypes>

#include "esc.h"
#include "hosts/suite.h"

namespace hosts {
namespace {
constexpr unsigned kRamEnd = place::kMaster + place::kMasterBytes;

uint32_t number(Host& host, unsigned address, unsigned bytes) {
  uint8_t data[4] = {0, 0, 0, 0};
  host.read(address, data, bytes);
  return data[0] | data[1] << 8 | data[2] << 16 | static_cast<uint32_t>(data[3]) << 24;
}
}  // namespace

Storm::Storm(Core& core, Host& host, Master& master, Random& random)
    : core_(core),
      host_(host),
      master_(master),
      random_(random),
      memory_(place::kHostBytes, 0) {
  host_.write(place::kHost, memory_.data(), place::kHostBytes);
  if (host_.counts()) clear();
}

void Storm::run(uint64_t accesses) {
  for (uint64_t i = 0; i < accesses; ++i) {
    if (random_.once(64)) master_.run(random_.once(2));
    switch (random_.below(4)) {
      case 0: good(); break;
      case 1: outside(); break;
      default: bad();
    }
    if (i % 4096 == 0) compare(place::kHost, place::kHostBytes);
  }
  master_.run(false);
  compare(place::kHost, place::kHostBytes);
}

void Storm::good() {
  Count& count = counts_["good"];
  ++count.done;
  const unsigned length = 1 + random_.below(random_.once(8) ? 16 : 4);
  const unsigned at = random_.below(place::kHostBytes - length + 1);
  if (random_.once(2)) {
    for (unsigned i = 0; i < length; ++i) memory_[at + i] = random_.byte();
    host_.write(place::kHost + at, &memory_[at], length);
  }
  compare(place::kHost + at, length);
}

// Beyond the RAM, reserved and protected: it reads 0, or what was there, and writes nothing, without an
// error.
void Storm::outside() {
  static const struct {
    const char* kind;
    unsigned first, bytes;
    bool reads0;
  } kPlaces[] = {
      {"beyond the RAM", kRamEnd, 0x10000 - kRamEnd - 8, true},
      {"reserved", 0x0f20, 0x40, true},
      {"protected", ESC_ESC_TYPE, 8, false},
      {"protected", ESC_DL_CONTROL, 4, false},
      {"protected", ESC_SMN_START(0), 6, false},
  };
  const auto& where = kPlaces[random_.below(5)];
  ++counts_[where.kind].done;
  const unsigned length = 1 + random_.below(4);
  const unsigned address = where.first + random_.below(where.bytes - length + 1);
  const uint32_t before = number(host_, address, length);
  if (where.reads0 && before) throw Wrong("something is read at " + std::to_string(address));
  uint8_t data[4];
  for (uint8_t& b : data) b = random_.byte();
  host_.write(address, data, length);
  if (number(host_, address, length) != before)
    throw Wrong("a write to " + std::to_string(address) + " has had an effect");
}

void Storm::bad() {
  const unsigned at = random_.below(place::kHostBytes - 8), address = place::kHost + at;
  const Bad bad = host_.bad(address);
  errors(bad);
  for (const Bad::Byte& b : bad.written) {
    uint8_t& was = memory_[b.address - place::kHost];
    const auto is = static_cast<uint8_t>(number(host_, b.address, 1));
    if (is != b.value && (b.certain || is != was))
      throw Wrong(bad.kind + ": the byte at " + std::to_string(b.address) + " is " + std::to_string(is) +
                  " and not " + std::to_string(b.value) + (b.certain ? "" : " or as it was"));
    was = is;
  }
  // Nothing else, and a good access behind it is right.
  compare(place::kHost + (at & ~7u), 8);
  memory_[at] = random_.byte();
  host_.write(address, &memory_[at], 1);
  compare(address, 1);
}

void Storm::errors(const Bad& bad) {
  Count& count = counts_[bad.kind];
  ++count.done;
  if (!host_.counts()) return;
  core_.cycle(40);  // counted in the register RAM, when it has time
  const uint32_t now = number(host_, ESC_PDI_ERROR, 3);
  const int more = static_cast<int>(now & 0xff) - errors_;
  if (more < bad.least || more > bad.most)
    throw Wrong(bad.kind + ": counted " + std::to_string(more) + " times, code " + std::to_string(now >> 8));
  if (more && ((now >> 8 ^ bad.code) & bad.known))
    throw Wrong(bad.kind + ": the code is " + std::to_string(now >> 8) + " and not " +
                std::to_string(bad.code));
  count.counted += static_cast<uint64_t>(more);
  errors_ = static_cast<uint8_t>(now);
  if (errors_ < 200) return;
  clear();
}

// A write of the master clears counter and code, one of the host nothing.
void Storm::clear() {
  const uint32_t before = number(host_, ESC_PDI_ERROR, 3);
  const uint8_t any = random_.byte();
  host_.write(ESC_PDI_ERROR, &any, 1);
  if (number(host_, ESC_PDI_ERROR, 3) != before) throw Wrong("the host has changed the error counter");
  master_.write(ESC_PDI_ERROR, random_.byte(), 1);
  if (number(host_, ESC_PDI_ERROR, 3)) throw Wrong("the error counter is not cleared");
  errors_ = 0;
}

void Storm::compare(unsigned address, unsigned length) {
  std::vector<uint8_t> is(length);
  host_.read(address, is.data(), length);
  for (unsigned i = 0; i < length; ++i)
    if (is[i] != memory_[address - place::kHost + i])
      throw Wrong("the byte at " + std::to_string(address + i) + " is " + std::to_string(is[i]) +
                  " and not " + std::to_string(memory_[address - place::kHost + i]));
}

void Storm::print() const {
  for (const auto& [kind, count] : counts_)
    std::printf("  %-24s %10" PRIu64 " done, %10" PRIu64 " counted\n", kind.c_str(), count.done,
                count.counted);
}

}  // namespace hosts
