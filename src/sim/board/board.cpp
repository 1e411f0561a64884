#include "board/board.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <random>

#include "core/slave.h"
#include "core/user_error.h"

namespace {
constexpr double kInterruptNs = 500;  // between two looks at the interrupt pin
constexpr uint32_t kPassUs = 1000;    // a host that waits for so long is at the end of a pass
constexpr uint8_t kErased = 0xff;
}  // namespace

FirmwareHost::FirmwareHost(BoardHardware& hardware, Passes passes)
    : hardware_(hardware),
      passes_(passes),
      log_(BOARD_LOG_RECORDS * BOARD_LOG_BYTES, kErased) {
  std::ifstream file(logFile(), std::ios::binary);
  if (file) file.read(reinterpret_cast<char*>(log_.data()), static_cast<std::streamsize>(log_.size()));
}

std::string FirmwareHost::command(const std::vector<std::string>&) {
  throw UserError("the host program '" + hardware_.name + "' knows no commands.");
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
  if (!hardware_.storageWorks) return false;
  if (!std::filesystem::exists(hardware_.store)) return true;
  std::ifstream file(hardware_.store);
  return static_cast<bool>(file >> number);
}

// By way of another file: the old number or the new one stays, whatever happens meanwhile.
bool FirmwareHost::store(uint32_t number) const {
  if (!hardware_.storageWorks) return false;
  const std::filesystem::path fresh = hardware_.store.string() + ".new";
  std::ofstream file(fresh, std::ios::trunc);
  file << number << "\n";
  file.close();
  std::error_code failed;
  if (file) std::filesystem::rename(fresh, hardware_.store, failed);
  return file && !failed;
}

bool FirmwareHost::writeLog(uint16_t index, const uint8_t* record) {
  if (!hardware_.storageWorks) return false;
  std::copy(record, record + BOARD_LOG_BYTES, log_.begin() + index * BOARD_LOG_BYTES);
  if (!std::filesystem::exists(logFile())) {
    std::ofstream whole(logFile(), std::ios::binary);
    whole.write(reinterpret_cast<const char*>(log_.data()), static_cast<std::streamsize>(log_.size()));
    return static_cast<bool>(whole);
  }
  std::fstream file(logFile(), std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(index * BOARD_LOG_BYTES);
  file.write(reinterpret_cast<const char*>(record), BOARD_LOG_BYTES);
  file.close();
  return static_cast<bool>(file);
}

bool FirmwareHost::readLog(uint16_t index, uint8_t* record) const {
  const auto begin = log_.begin() + index * BOARD_LOG_BYTES;
  std::copy(begin, begin + BOARD_LOG_BYTES, record);
  return hardware_.storageWorks;
}

uint8_t FirmwareHost::inputs() {
  uint8_t all = hardware_.contacts;
  for (int i = 0; i < BOARD_INPUTS; ++i)
    if (hardware_.pressed[static_cast<size_t>(i)] > slave().nextRise()) all |= static_cast<uint8_t>(1 << i);
  return all;
}

void FirmwareHost::serveWatchdog() { hardware_.watched = slave().nextRise(); }

void FirmwareHost::boot() {
  if (hardware_.bootMs > 0) sleepNs(hardware_.bootMs * 1e6);
}

void FirmwareHost::endPass() {
  if (hardware_.slowMs > 0) sleepNs(hardware_.slowMs * 1e6);
}

bool FirmwareHost::isWoken() { return slave().irq(); }

void FirmwareHost::waitForInterrupt(uint32_t us) {
  const uint64_t end = slave().cycles() + us * static_cast<uint64_t>(kUs / slave().corePeriod());
  while (!isWoken() && slave().cycles() < end) sleepNs(kInterruptNs);
  if (us >= kPassUs && passes_ == Passes::endWaiting) endPass();
}

uint32_t FirmwareHost::timeUs() { return static_cast<uint32_t>(slave().nextRise() / kUs); }

void FirmwareHost::notice(const char* sentence) {
  hardware_.notices.push_back(sentence);
  std::fprintf(stderr, "host of %s: %s\n", hardware_.name.c_str(), sentence);
}

void FirmwareHost::draw(uint8_t* bytes, uint16_t length) {
  std::random_device device;
  std::generate_n(bytes, length,
                  [&] { return static_cast<uint8_t>(hardware_.noise ? (*hardware_.noise)() : device()); });
}

extern "C" {
void board_read(board* b, uint16_t address, uint8_t* data, uint16_t length) {
  b->host->readRegisters(static_cast<uint16_t>(b->base + address), data, length);
}
void board_write(board* b, uint16_t address, const uint8_t* data, uint16_t length) {
  b->host->writeRegisters(static_cast<uint16_t>(b->base + address), data, length);
}
bool board_load(board* b, uint32_t* number) { return b->host->load(*number); }
bool board_store(board* b, uint32_t number) { return b->host->store(number); }
bool board_log_write(board* b, uint16_t index, const uint8_t* record) {
  return b->host->writeLog(index, record);
}
bool board_log_read(board* b, uint16_t index, uint8_t* record) { return b->host->readLog(index, record); }
bool board_random(board* b, uint8_t* bytes, uint16_t length) { return b->host->draw(bytes, length), true; }
void board_wait(board* b, uint32_t us) { b->host->waitForInterrupt(us); }
uint32_t board_time(board* b) { return b->host->timeUs(); }
void board_watchdog(board* b) { b->host->serveWatchdog(); }
uint8_t board_inputs(board* b) { return b->host->inputs(); }
void board_display(board* b, uint8_t line, const char* text) { b->host->display(line, text); }
void board_notice(board* b, const char* sentence) { b->host->notice(sentence); }
}
