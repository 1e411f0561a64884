// The description of a fibre ring.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/eeprom.h"
#include "core/ethernet.h"
#include "ring/fibre.h"

extern "C" {
#include "node/ring_node.h"
}

struct RingNodeSpec {
  std::string preset = "ring-node";
  ring_node_parameters parameters{};
  // "none", "node", "can": CAN programs in a host's place, "server" or "gateway", to an EtherCAT master
  std::string program = "node";
  std::optional<Bytes> eeprom;  // of a gateway
  const EepromChip* eepromChip = nullptr;
  std::string pair;  // on which its port T is; empty: on none
  double clockPpm = 0;
  double fibreKm = 0.2;  // from its port 2 to port 1 of the next
  Optics optics;         // of that, both ways
};

struct RingSpec {
  std::vector<RingNodeSpec> nodes;
  // Controllers on twisted pairs, for CAN programs; their fibres lead nowhere. They stand behind the nodes.
  std::vector<RingNodeSpec> controllers;
  bool closed = true;  // a fibre leads from the last node to the first
  uint64_t seed = 1;   // of phases of clocks, and of errors on fibres
};

// Reads a network file; UserError says what is wrong with it.
RingSpec readRing(const std::string& path);
