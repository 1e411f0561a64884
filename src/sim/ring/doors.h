// The doors of a ring: each leads to the port of a node whose host is `can`.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "ring/door.h"
#include "ring/ring.h"

class Doors {
 public:
  // What is asked for on the command line: NODE=PATH, NODE=PORT, for cannelloni NODE=PORT:PEER, too.
  struct Options {
    std::vector<std::string> slcan, socketcand, cannelloni, socketcan, pcap, candump;
  };
  Doors(Ring& ring, const Options& options);
  // Moves frames between ports and programs; never waits.
  void serve();
  nlohmann::ordered_json status() const;

 private:
  size_t nodeOf(const std::string& option, std::string& value) const;
  void add(size_t node, std::unique_ptr<Door> door) { doors_[node].push_back(std::move(door)); }

  Ring& ring_;
  std::vector<std::vector<std::unique_ptr<Door>>> doors_;  // by node
  std::vector<size_t> first_;                              // to be served, by node
};
