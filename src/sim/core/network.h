// A simulated line, ring or tree of slaves with the master's network card at its head, in a ring also at its
// end.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/link.h"
#include "core/network_file.h"
#include "core/slave.h"

class VerilatedFstC;

struct NetworkOptions {
  bool skipIdle = true;
  double settleUs = 4;    // the network is idle when nothing has been on any wire for so long
  std::string traceFile;  // empty: no trace
};

class Network {
 public:
  // Takes each frame that comes to a card of the master, and the simulated time of its last nibble.
  using OnFrame = std::function<void(int64_t ns, const NibbleFrame&, size_t card)>;

  // Builds the network and powers it up: reset, EEPROM contents loaded by the local hosts, links up.
  Network(const NetworkSpec& spec, const NetworkOptions& options, OnFrame onFrame);
  ~Network();

  // Simulated time since power-up in ns, skipped idle time included.
  int64_t ns() const { return sim_.now() / kNs + skippedNs_; }
  int64_t skippedNs() const { return skippedNs_; }
  // Sends a frame from a card of the master behind those that wait there; the minimum gap follows it.
  // Returns the simulated time of its last nibble, if none waited.
  int64_t send(const Bytes& frame, size_t card = 0);
  // The card has nothing left to send.
  bool sent(size_t card = 0) const { return cards_[card]->sender().backlog() == 0; }
  // One, or two in a ring.
  size_t cards() const { return cards_.size(); }
  // Nothing moves on any wire, and the last thing that did has settled.
  bool quiet() const;
  // Nor does an EEPROM: idle time may be skipped.
  bool idle() const;
  // One event; if the network is idle, jumps to `wakeNs` instead.
  void step(int64_t wakeNs);
  // For a quiet network: simulates all slaves until `ns` without receive clocks and nibbles, much faster than
  // by step(). Clocks, timers, EEPROMs and hosts go on.
  void idleUntil(int64_t ns);
  // The cable before a slave; in a ring, the one behind the last slave is the last one.
  Link& link(size_t number) { return *links_[number]; }
  size_t links() const { return links_.size(); }
  // How often a cable's link drops by itself, and for how long, in the mean.
  void setDrops(size_t link, double perSecond, double us);
  size_t size() const { return slaves_.size(); }
  Slave& slave(size_t i) { return *slaves_[i]; }
  uint64_t coreCycles() const;

 private:
  // A crystal whose error goes up and down.
  struct Drift {
    size_t slave;
    double mean, height, seconds, phase;
  };
  Time quietFor() const;
  void skip(int64_t ns);
  void addSlave(const SlaveSpec& spec, Time phase);
  void powerUp(const std::vector<SlaveSpec>& specs);
  // What changes by itself: links and crystals.
  void change();
  void loadEeprom(size_t slave, const SlaveSpec& spec);
  void hostWrite(size_t slave, uint16_t addr, uint8_t value);
  void trace(const std::string& path);

  NetworkOptions options_;
  VerilatedContext context_;
  Simulator sim_;
  std::vector<std::unique_ptr<Slave>> slaves_;
  std::vector<std::unique_ptr<Card>> cards_;
  std::vector<std::unique_ptr<Link>> links_;
  std::vector<Drift> drifts_;
  Time nextChange_ = kNever;
  std::unique_ptr<VerilatedFstC> trace_;
  Time settle_ = 0, quietAfter_ = 0;
  int64_t skippedNs_ = 0, tracedPs_ = -1;
};
