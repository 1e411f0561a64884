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

// The device of the demonstration: its inputs are its outputs.
class StackHost : public Host {
 public:
  ~StackHost() override { stop(); }
  // status | emergency CODE
  std::string command(const std::vector<std::string>& words) override;

 protected:
  void run() override;

 private:
  static StackHost& of(void* context) { return *static_cast<StackHost*>(context); }

  board board_;
  io_device io_{};
  uint16_t outputs_ = 0;
  bool lamp_ = false;
  Bytes firmware_;
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
  hardware.store = [](void* h, uint32_t offset, const uint8_t* data, uint16_t length) {
    Bytes& file = of(h).firmware_;
    if (offset + length > kFirmwareMost) return false;
    file.resize(offset);
    file.insert(file.end(), data, data + length);
    return true;
  };
  hardware.fetch = [](void* h, uint32_t offset, uint8_t* data, uint16_t most) {
    const Bytes& file = of(h).firmware_;
    const size_t from = std::min<size_t>(offset, file.size()),
                 count = std::min<size_t>(most, file.size() - from);
    std::copy_n(file.begin() + static_cast<long>(from), count, data);
    return static_cast<uint16_t>(count);
  };
  for (io_device_start(&io_, &board_, &hardware);; sleepNs(kReactionNs)) io_device_serve(&io_);
}

std::string StackHost::command(const std::vector<std::string>& words) {
  const auto code = [&] { return static_cast<uint16_t>(std::stoul(words[1], nullptr, 0)); };
  char text[120];
  if (words.size() == 1 && words[0] == "status") {
    std::snprintf(text, sizeof text, "state %u outputs 0x%04x lamp %d firmware %zu bytes",
                  io_.device.slave.state, outputs_, lamp_, firmware_.size());
    return text;
  }
  if (words.size() == 2 && words[0] == "emergency")
    return slave_emergency(&io_.device.slave, code(), 0, nullptr) ? "" : "full";
  throw UserError("the host program 'stack' knows: status, emergency CODE.");
}

const bool added = addHostProgram("stack", [](const HostOptions&) { return std::make_unique<StackHost>(); });
}  // namespace
