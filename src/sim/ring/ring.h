// A fibre ring: nodes in RTL, each with its fibre to the next, and their host programs.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "ring/can_host.h"
#include "ring/ethernet_cable.h"
#include "ring/fibre.h"
#include "ring/gateway_host.h"
#include "ring/network_file.h"
#include "ring/node_host.h"
#include "ring/pair.h"
#include "ring/server_host.h"
#include "ring/workers.h"

struct RingOptions {
  std::filesystem::path state;  // folder of the non-volatile memories
  size_t processors = 2;
  // Of the gateway, but for its node.
  ring_server_parameters server{};
};

class Ring {
 public:
  Ring(const RingSpec& spec, const RingOptions& options);

  Time now() const { return now_; }
  // Nodes, and behind them the controllers on twisted pairs.
  size_t size() const { return nodes_.size(); }
  uint64_t seed() const { return spec_.seed; }
  const RingNodeSpec& spec(size_t i) const { return spec_.nodes[i]; }
  Slave& node(size_t i) { return *nodes_[i]->slave; }
  BoardHardware& board(size_t i) { return nodes_[i]->board; }
  // The host program, if it is one of that kind and runs.
  RingNodeHost* program(size_t i) { return dynamic_cast<RingNodeHost*>(node(i).host()); }
  RingServerHost* serverProgram(size_t i) { return dynamic_cast<RingServerHost*>(node(i).host()); }
  RingGatewayHost* gatewayProgram(size_t i) { return dynamic_cast<RingGatewayHost*>(node(i).host()); }
  CanHost* canProgram(size_t i) { return dynamic_cast<CanHost*>(node(i).host()); }

  // The cable to the plant network, or to an EtherCAT master, of the node that has one; null if none has.
  EthernetCable* plant() { return cableOf(plant_); }
  EthernetCable* master() { return cableOf(master_); }

  // The fibre behind node i, which leads to port 1 of the next, or the one back to its port 2. One that is
  // not there, behind the last node of a line, is cut.
  size_t fibres() const { return ringSize_ - (spec_.closed ? 0 : 1); }
  Fibre& there(size_t i) { return *nodes_[i]->there; }
  Fibre& back(size_t i) { return *nodes_[i]->back; }

  // A node without power is dark; its host program starts anew when it has power again.
  bool powered(size_t i) const { return nodes_[i]->powered; }
  void setPower(size_t i, bool on);
  // A transceiver on a twisted pair is stuck dominant, or not any more.
  void holdPair(const std::string& name, bool dominant);
  // Ends the host program of a node, whose controller goes on, or starts it anew.
  void setHost(size_t i, bool runs);
  // Resets the controller, whose host goes on.
  void resetController(size_t i);

  // Simulates as long as light needs on the shortest fibre, at least for that.
  void advance();
  void runUntil(Time end) {
    while (now_ < end) advance();
  }
  uint64_t coreCycles() const;

 private:
  struct Node {
    VerilatedContext context;
    std::unique_ptr<Slave> slave;
    std::unique_ptr<Fibre> there, back;
    std::optional<EthernetCable> cable;
    BoardHardware board;
    bool powered = true;
    Time resetEnd = 0;  // kNever: the reset is not active
    bool boots = true;  // its host begins behind the reset
  };
  EthernetCable* cableOf(std::optional<size_t> node) { return node ? &*nodes_[*node]->cable : nullptr; }
  std::unique_ptr<Host> makeHost(size_t i);
  Fibre& into(size_t i, int port);
  void share(size_t processor);
  void runNode(Node& node, size_t i);

  RingSpec spec_;  // of all: its nodes are followed by its controllers
  RingOptions options_;
  size_t ringSize_;
  std::optional<size_t> plant_, master_;  // the nodes
  std::map<std::string, Pair> pairs_;
  std::vector<std::unique_ptr<Node>> nodes_;
  Time now_ = 0, window_ = 0;
  int phase_ = 0;  // of the fibres
  std::optional<Workers> workers_;
};
