// A board with a host program of src/firmware, as the local processor of a simulated controller.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "core/host.h"
#include "core/simulator.h"

extern "C" {
#include "panel.h"
#include "port.h"
}

class FirmwareHost;
struct board {
  FirmwareHost* host;
  uint16_t base = 0;  // what is added to addresses: a host may see several in one controller
};

// What a board has besides its host program: it stays when that starts anew.
struct BoardHardware {
  std::string name;             // for messages, and that of its files
  std::filesystem::path store;  // non-volatile memory: a number, and behind ".log" the log
  bool storageWorks = true;
  uint8_t contacts = 0;                      // those that stay: enum of port.h
  std::array<Time, BOARD_INPUTS> pressed{};  // buttons: until when
  double slowMs = 0;                         // what each pass of the program takes longer
  double bootMs = 0;                         // what its start takes longer
  std::array<std::string, PANEL_MOST_LINES> display;
  Time watched = 0;  // when the watchdog was served last; it resets nobody here
  std::vector<std::string> notices;
  // What it draws random numbers from, where a simulation is to be the same each time. Without one they are
  // really random: a server knows lives of earlier simulations.
  std::optional<std::mt19937> noise;
};

// A board with a host program in C.
class FirmwareHost : public Host {
 public:
  // How it is known that a pass of the program ends: where it waits for as long as it may, or it says so.
  enum class Passes { endWaiting, areTold };
  explicit FirmwareHost(BoardHardware& hardware, Passes passes = Passes::endWaiting);
  std::string command(const std::vector<std::string>& words) override;

  // What struct board stands for.
  void readRegisters(uint16_t address, uint8_t* data, uint16_t length);
  void writeRegisters(uint16_t address, const uint8_t* data, uint16_t length);
  bool load(uint32_t& number) const;
  bool store(uint32_t number) const;
  bool writeLog(uint16_t index, const uint8_t* record);
  bool readLog(uint16_t index, uint8_t* record) const;
  void waitForInterrupt(uint32_t us);
  uint32_t timeUs();
  void serveWatchdog();
  uint8_t inputs();
  void display(uint8_t line, const char* text) { hardware_.display.at(line) = text; }
  void notice(const char* sentence);
  void draw(uint8_t* bytes, uint16_t length);

 protected:
  // Before the program begins.
  void boot();
  // A pass of the program ends: a slow host takes longer.
  void endPass();
  // Waiting ends.
  virtual bool isWoken();
  board board_{this};

 private:
  std::filesystem::path logFile() const { return hardware_.store.string() + ".log"; }
  BoardHardware& hardware_;
  Passes passes_;
  std::vector<uint8_t> log_;
};
