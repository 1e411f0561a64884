// A host at the pins of a controller, as its bus has them: what the driver uses, and what a bad one does.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "hosts/core.h"
#include "smsoak/random.h"

namespace hosts {

using smsoak::Random;

// What a bad access must have done (B-114 to B-117).
struct Bad {
  std::string kind;
  int least = 0, most = 0;            // errors counted
  uint16_t code = 0, known = 0xffff;  // 0x030E if one was, and which bits of it are certain
  struct Byte {
    unsigned address;
    uint8_t value;
    bool certain;  // written; else perhaps
  };
  std::vector<Byte> written;
};

class Host {
 public:
  Host(Core& core, Random& random) : core_(core), random_(random) {}
  virtual ~Host() = default;

  // Bytes in ascending order, each once (AXI4-Lite reads whole words).
  virtual void read(unsigned address, uint8_t* data, unsigned length) = 0;
  virtual void write(unsigned address, const uint8_t* data, unsigned length) = 0;
  // Something a host must not do, or is ignored, to the byte at `address` or the word around it.
  virtual Bad bad(unsigned address) = 0;
  // At rest before reset ends.
  virtual void rest() = 0;
  // Accesses as fast as the interface allows, without moments at random.
  virtual void hurry() { hurries_ = true; }

  bool irq() const { return *core_.pins().irq; }
  // Whether the interface counts its errors in 0x030D.
  virtual bool counts() const { return true; }
  // With SPI: the event request that came with the last address; else -1.
  virtual int64_t eventsSeen() const { return -1; }

 protected:
  int some(int low, int high) { return hurries_ ? low : random_.range(low, high); }
  Core& core_;
  Random& random_;
  bool hurries_ = false;
};

// Words of the bus, each with its byte enables.
class WordHost : public Host {
 public:
  using Host::Host;
  void read(unsigned address, uint8_t* data, unsigned length) override;
  void write(unsigned address, const uint8_t* data, unsigned length) override;

 protected:
  unsigned lanes() const { return static_cast<unsigned>(core_.info().lanes()); }
  unsigned wordOf(unsigned address) const { return (address & 0xffff) / lanes(); }
  // Enables and data of one byte in its lane.
  unsigned enableOf(unsigned address) const { return 1u << (address % lanes()); }
  uint32_t inLane(unsigned address, uint8_t value) const {
    return static_cast<uint32_t>(value) << (8 * (address % lanes()));
  }
  // One access to a word: number of the word, enables of its bytes.
  virtual uint32_t access(bool write, unsigned word, uint32_t data, unsigned enables) = 0;
};

// A host that fits `hostInterface`, at rest.
std::unique_ptr<Host> makeHost(Core& core, Random& random);

std::unique_ptr<Host> makePort(Core& core, Random& random);
std::unique_ptr<Host> makeAvalon(Core& core, Random& random);
std::unique_ptr<Host> makeAxiLite(Core& core, Random& random);
std::unique_ptr<Host> makeWishbone(Core& core, Random& random);
std::unique_ptr<Host> makeSpi(Core& core, Random& random);
std::unique_ptr<Host> makeMicrocontroller(Core& core, Random& random);

}  // namespace hosts
