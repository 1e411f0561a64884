// Sends the master's frames of a recording into a network and records what comes back.
#pragma once

#include <cstdint>
#include <string>

#include "core/network.h"

struct ReplayOptions {
  std::string in, out;
  bool both = false;        // record the sent frames too
  double timeoutUs = 1000;  // a frame that takes longer to come back is lost
};

struct ReplayResult {
  uint64_t sent = 0, returned = 0, lost = 0;
  uint64_t badFcs = 0, runts = 0;  // came back, but no network card would have shown them
  int64_t simulatedNs = 0, skippedNs = 0;
  uint64_t coreCycles = 0;
};

ReplayResult replay(const NetworkSpec& spec, const NetworkOptions& networkOptions,
                    const ReplayOptions& options);
