#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>

// The host program "stack": the slave stack with the device of the demonstration (src/firmware/demo).
#include "core/host.h"
#include "core/slave.h"
#include "core/user_error.h"

extern "C" {
#include "demo/io_device.h"
}

// What the driver reaches its controller through.
struct board {
  std::function<void(uint16_t, uint8_t*, uint16_t)> read;
  std::function<void(uint16_t, const uint8_t*, uint16_t)> write;
};

extern "C" {
void board_read(board* b, uint16_t address, uint8_t* data, uint16_t length) {
  b->read(address, data, length);
}
void board_write(board* b, uint16_t address, const uint8_t* data, uint16_t length) {
  b->write(address, data, length);
}
}

namespace {
constexpr double kReactionNs = 500;  // from one pass of the program to the next
constexpr size_t kFirmwareMost = 2 << 20;
constexpr uint64_t kEraseNs = 200'000;

// A flash memory: it is erased first, busy now and then, and refuses what a bench wants it to.
class Flash {
 public:
  Bytes content;
  unsigned busyEvery = 8;  // accesses; 1: before each
  int64_t refused = -1;    // the access, counted from the opening, that it refuses; -1: none

  // From an opening on, if it is the first call of it.
  uint32_t erase(double ns) {
    if (erased_ < 0) erased_ = ns + kEraseNs;
    if (ns < erased_) return SLAVE_FILE_BUSY;
    content.clear(), begin();
    return 0;
  }
  int64_t accesses() const { return accesses_; }  // since the opening
  void begin() { erased_ = -1, accesses_ = 0, waited_ = false; }
  uint32_t store(uint32_t offset, const uint8_t* data, uint16_t length) {
    if (const uint32_t error = access()) return error;
    if (offset + length > kFirmwareMost) return FOE_DENIED;
    content.resize(offset);
    content.insert(content.end(), data, data + length);
    return 0;
  }
  uint32_t fetch(uint32_t offset, uint8_t* data, uint16_t most, uint16_t* length) {
    if (offset == 0 && !waited_) accesses_ = 0;
    if (const uint32_t error = access()) return error;
    const size_t from = std::min<size_t>(offset, content.size());
    *length = static_cast<uint16_t>(std::min<size_t>(most, content.size() - from));
    std::copy_n(content.begin() + static_cast<long>(from), *length, data);
    return 0;
  }

 private:
  uint32_t access() {
    waited_ = !waited_ && (accesses_ + 1) % busyEvery == 0;
    if (waited_) return SLAVE_FILE_BUSY;
    return accesses_++ == refused ? FOE_DENIED : 0;
  }
  double erased_ = -1;
  int64_t accesses_ = 0;
  bool waited_ = false;
};

// The device of the demonstration: its inputs are its outputs.
class StackHost : public Host {
 public:
  ~StackHost() override { stop(); }
  // status | emergency CODE | busy EVERY | refuse ACCESS
  std::string command(const std::vector<std::string>& words) override;

 protected:
  void run() override;

 private:
  static StackHost& of(void* context) { return *static_cast<StackHost*>(context); }
  void startWithSync();

  board board_;
  slave_device device_ = slave_demo_device;
  io_device io_{};
  uint16_t outputs_ = 0;
  bool lamp_ = false;
  Flash flash_;
};

void StackHost::run() {
  board_.read = [this](uint16_t address, uint8_t* data, uint16_t length) {
    const Bytes bytes = read(address, length);
    std::copy(bytes.begin(), bytes.end(), data);
  };
  board_.write = [this](uint16_t address, const uint8_t* data, uint16_t length) {
    write(address, Bytes(data, data + length));
  };
  io_board hardware{};
  hardware.context = this;
  hardware.drive = [](void* h, uint16_t outputs, bool lamp) { of(h).outputs_ = outputs, of(h).lamp_ = lamp; };
  hardware.sense = [](void* h) { return of(h).outputs_; };
  hardware.erase = [](void* h) {
    Slave& s = of(h).slave();
    return of(h).flash_.erase(static_cast<double>(s.cycles()) * static_cast<double>(s.corePeriod()) / kNs);
  };
  hardware.store = [](void* h, uint32_t offset, const uint8_t* data, uint16_t length) {
    return of(h).flash_.store(offset, data, length);
  };
  hardware.fetch = [](void* h, uint32_t offset, uint8_t* data, uint16_t most, uint16_t* length) {
    return of(h).flash_.fetch(offset, data, most, length);
  };
  io_device_start(&io_, &board_, &hardware);
  if (slave().hasSync()) startWithSync();
  for (;; sleepNs(kReactionNs)) io_device_serve(&io_);
}

// As the device file says with `dcModes`: that of the demonstration is for a controller without clocks.
void StackHost::startWithSync() {
  const slave_memory memory = io_.device.slave.memory;
  device_.sync = true;
  slave_start(&io_.device.slave, &board_, &device_, &memory, &io_.application);
}

std::string StackHost::command(const std::vector<std::string>& words) {
  const auto code = [&] { return static_cast<uint16_t>(std::stoul(words[1], nullptr, 0)); };
  char text[120];
  if (words.size() == 1 && words[0] == "status") {
    std::snprintf(text, sizeof text, "state %u outputs 0x%04x lamp %d firmware %zu bytes, packets %lld",
                  io_.device.slave.state, outputs_, lamp_, flash_.content.size(),
                  static_cast<long long>(flash_.accesses()));
    return text;
  }
  if (words.size() == 2 && words[0] == "busy") return flash_.busyEvery = std::max<unsigned>(code(), 1), "";
  if (words.size() == 2 && words[0] == "refuse") return flash_.refused = std::stol(words[1]), "";
  if (words.size() == 2 && words[0] == "emergency")
    return slave_emergency(&io_.device.slave, code(), 0, nullptr) ? "" : "full";
  throw UserError("the host program 'stack' knows: status, emergency CODE, busy EVERY, refuse ACCESS.");
}

const bool added = addHostProgram("stack", [](const HostOptions&) { return std::make_unique<StackHost>(); });
}  // namespace
