#include "alarm/host.h"

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "alarm-master.h"
#include "core/slave.h"
#include "core/user_error.h"

namespace {
constexpr double kInterruptNs = 500;  // between two looks at the interrupt pin
}  // namespace

std::string FirmwareHost::command(const std::vector<std::string>&) {
  throw UserError("the host program '" + name_ + "' knows no commands.");
}

void FirmwareHost::readRegisters(uint16_t address, uint8_t* data, uint16_t length) {
  const Bytes bytes = read(address, length);
  std::copy(bytes.begin(), bytes.end(), data);
}

void FirmwareHost::writeRegisters(uint16_t address, const uint8_t* data, uint16_t length) {
  write(address, Bytes(data, data + length));
}

bool FirmwareHost::load(uint32_t& number) const {
  number = 0;
  if (!std::filesystem::exists(store_)) return true;
  std::ifstream file(store_);
  return static_cast<bool>(file >> number);
}

// By way of another file: the old number or the new one stays, whatever happens meanwhile.
bool FirmwareHost::store(uint32_t number) const {
  const std::filesystem::path fresh = store_.string() + ".new";
  std::ofstream file(fresh, std::ios::trunc);
  file << number << "\n";
  file.close();
  std::error_code failed;
  if (file) std::filesystem::rename(fresh, store_, failed);
  return file && !failed;
}

bool FirmwareHost::isWoken() { return slave().irq(); }

void FirmwareHost::waitForInterrupt(uint32_t us) {
  const uint64_t end = slave().cycles() + us * static_cast<uint64_t>(kUs / slave().corePeriod());
  while (!isWoken() && slave().cycles() < end) sleepNs(kInterruptNs);
}

void FirmwareHost::fail(const char* sentence) {
  failure_ = sentence;
  std::fprintf(stderr, "host of %s: %s\n", name_.c_str(), sentence);
  for (;;) sleepNs(1e9);
}

// As alarm_master_run() does, but for the counters.
void AlarmMasterHost::run() {
  if (alarm_master_start(&master_, &board_, &parameters_) != SELF_TEST_GOOD)
    board_fatal(&board_, self_test_text(master_.self_test));
  for (;;) {
    alarm_master_serve(&master_);
    if (counters_) continue;
    Counters read;  // refused, dropped, bad frames at each port (HOST-07)
    readRegisters(MASTER_REFUSED_DATAGRAMS, read.data(), read.size());
    const uint8_t any = 0;
    writeRegisters(MASTER_REFUSED_DATAGRAMS, &any, 1);
    counters_ = read;
  }
}

extern "C" {
void board_read(board* b, uint16_t address, uint8_t* data, uint16_t length) {
  b->host->readRegisters(address, data, length);
}
void board_write(board* b, uint16_t address, const uint8_t* data, uint16_t length) {
  b->host->writeRegisters(address, data, length);
}
bool board_load(board* b, uint32_t* number) { return b->host->load(*number); }
bool board_store(board* b, uint32_t number) { return b->host->store(number); }
void board_wait(board* b, uint32_t us) { b->host->waitForInterrupt(us); }
void board_fatal(board* b, const char* sentence) { b->host->fail(sentence); }
}
