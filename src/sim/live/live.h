// Joins a Linux interface, or two with a ring: a real master sees the simulated network.
#pragma once

#include <cstdint>
#include <string>

#include "core/network.h"

struct LiveOptions {
  std::string interface;
  std::string ringInterface;  // of the master's second card; empty: there is none
  std::string control;        // path of the control socket; empty: none
  std::string sync;           // file that gets the edges of SYNC signals; empty: none
  double timeScale = 1;       // simulated time per wall time while idle; 0: idle time stands still
  double staleMs = 0;         // wall time after which a frame that waits is lost; 0: never
};

struct LiveResult {
  uint64_t received = 0, returned = 0, lost = 0, stale = 0;
  uint64_t badFcs = 0, runts = 0;  // came back, but no network card would have shown them
  int64_t simulatedNs = 0;
  uint64_t coreCycles = 0;
  double busySeconds = 0;                    // wall time spent simulating
  double meanRoundUs = 0, worstRoundUs = 0;  // wall time from a frame's arrival to its return
};

// Runs until SIGINT, SIGTERM or the control line `quit`.
LiveResult live(const NetworkSpec& spec, const NetworkOptions& networkOptions, const LiveOptions& options);
