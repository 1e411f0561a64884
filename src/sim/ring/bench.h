// Who stands at the ring: what the control socket's lines ask for.
#pragma once

#include <nlohmann/json.hpp>

#include "ring/doors.h"
#include "ring/ring.h"

class RingBench {
 public:
  RingBench(Ring& ring, const Doors& doors) : ring_(ring), doors_(doors) {}
  // A line of the control socket: src/sim/README.md has them all.
  std::string command(const std::vector<std::string>& words);

 private:
  size_t node(const std::string& text) const;
  RingNodeHost& program(const std::string& node);
  bool commandOfFibre(const std::vector<std::string>& words);
  bool commandOfNode(const std::vector<std::string>& words);
  bool commandOfProgram(const std::vector<std::string>& words, std::string& answer);
  void optics(const std::vector<std::string>& words);
  nlohmann::ordered_json messages(RingNodeHost& host);
  nlohmann::ordered_json statusOf(size_t i);
  nlohmann::ordered_json statusOfGateway(const ring_server& gateway);
  nlohmann::ordered_json status();

  Ring& ring_;
  const Doors& doors_;
};
