// The description of a network: a line of slaves, the master at port 0 of the first.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/eeprom.h"
#include "core/ethernet.h"
#include "core/host.h"

struct SlaveSpec {
  std::string preset;
  std::optional<Bytes> eeprom;  // image, if one was named
  std::string eepromPath;
  const EepromChip* eepromChip = nullptr;  // the one that holds the image; with an image never null
  std::string eepromSave;                  // file that gets what the master writes; empty: none
  HostOptions host;                        // program of the local processor
  double cableNs = 50;                     // cable before the slave
  double clockPpm = 0;
};

// Reads a network file and the EEPROM images it names; UserError says what is wrong with it.
std::vector<SlaveSpec> readNetwork(const std::string& path);

// Why the configuration area of an EEPROM image is not valid (SII-01 to SII-03); empty if it is.
std::string eepromProblem(const Bytes& image);
