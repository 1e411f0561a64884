// Bus and host act at the same time; each for itself acts in order. Of every action the cycles are known
// between which it took effect, and what it returned. The RTL is right if both histories can be merged into
// one order that the model answers alike.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "smsoak/model.h"

namespace smsoak {

struct Action {
  enum class Kind : uint8_t {
    // Bus.
    frameStarts,
    read,
    write,
    irqNibble,
    counter,
    frameEnds,
    commit,
    perhapsQuiet,
    quiet,  // by now; now, or before
    // Host.
    hostRead,
    hostWrite,
    interrupt,
  };
  Kind kind;
  uint64_t from, to;  // first and last cycle in which it may have taken effect
  uint16_t address;   // counter: 1 = the datagram reads, 2 = writes; irqNibble: number of the nibble;
                      // frameEnds: 1 = good
  uint8_t value;      // written; or sent, where the bus reads
  int result;         // what came back; -1 is not looked at
  unsigned managers;  // bit n: concerns SyncManager n or its memory
  uint64_t step;      // for messages
};

using History = std::vector<Action>;

// Goes on from `world` through both histories. False if there is no order; `why` then tells the mismatches.
bool merge(std::vector<World>& worlds, const History& bus, const History& host, std::string& why);

}  // namespace smsoak
