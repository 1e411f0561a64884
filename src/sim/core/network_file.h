// The description of a network: slaves in a line, a ring or a tree, the master at port 0 of the first.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/eeprom.h"
#include "core/ethernet.h"
#include "core/host.h"

struct CableSpec {
  double ns = 50;             // until a nibble is at the other end
  uint64_t bitErrors = 0;     // one bit of so many is flipped; 0: none
  double dropsPerSecond = 0;  // how often its link drops by itself, in the mean
  double dropUs = 500;        // for how long, in the mean
};

struct SlaveSpec {
  std::string preset;
  std::optional<Bytes> eeprom;  // image, if one was named
  std::string eepromPath;
  const EepromChip* eepromChip = nullptr;  // the one that holds the image; with an image never null
  std::string eepromSave;                  // file that gets what the master writes; empty: none
  HostOptions host;                        // program of the local processor
  bool wired = false;                      // its digital inputs are connected to its outputs
  CableSpec cable;                         // from its port 0 to
  size_t behind = 0;                       // this slave; the first one's leads to the master
  int port = 1;                            // and this port of it
  double clockPpm = 0;                     // the error of its crystal, which
  double driftPpm = 0;                     // goes up and down by so much
  double driftSeconds = 1;                 // in so many seconds
};

struct NetworkSpec {
  std::vector<SlaveSpec> slaves;
  std::optional<CableSpec> ring;  // a cable from port 1 of the last slave back to the master's second card
  double masterPpm = 0;           // the error of the master's crystal
  uint64_t seed = 1;              // of phases of clocks and drifts, bit errors and drops
};

// Reads a network file and the EEPROM images it names; UserError says what is wrong with it.
NetworkSpec readNetwork(const std::string& path);

// The image at `path`, and the smallest chip that holds it if none is given. `bad` is told what is wrong, and
// never returns.
Bytes readEeprom(const std::string& path, const EepromChip*& chip,
                 const std::function<void(const std::string&)>& bad);

// Why the configuration area of an EEPROM image is not valid (SII-01 to SII-03); empty if it is.
std::string eepromProblem(const Bytes& image);
