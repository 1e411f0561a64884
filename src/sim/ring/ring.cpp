#include "ring/ring.h"

#include <algorithm>
#include <random>

#include "core/user_error.h"

namespace {
constexpr Time kReset = 1 * kUs;
constexpr Time kLongest = 10 * kUs;  // between two looks of whoever asks something of the ring

// A node without power misses what came, but finds the last level when it has power again.
void keepLast(std::deque<LightEdge>& levels) {
  if (levels.size() > 1) levels.erase(levels.begin(), levels.end() - 1);
}
}  // namespace

Ring::Ring(const RingSpec& spec, const RingOptions& options)
    : spec_(spec),
      options_(options),
      ringSize_(spec.nodes.size()) {
  spec_.nodes.insert(spec_.nodes.end(), spec.controllers.begin(), spec.controllers.end());
  std::mt19937_64 random(spec.seed);
  window_ = kLongest;
  for (size_t i = 0; i < spec_.nodes.size(); ++i) {
    const RingNodeSpec& s = spec_.nodes[i];
    nodes_.push_back(std::make_unique<Node>());
    Node& n = *nodes_.back();
    const Preset& preset = findPreset(s.preset);
    const Time period = periodOf(preset.info.coreClockMhz, s.clockPpm);
    const std::string name = "node " + std::to_string(i + 1);
    n.slave = std::make_unique<Slave>(preset, n.context, "node" + std::to_string(i + 1), s.clockPpm,
                                      static_cast<Time>(random() % static_cast<uint64_t>(period)));
    n.board.name = name;
    n.board.store = options.state / ("node-" + std::to_string(i + 1));
    // The session numbers of a gateway are for a server that must not be able to foresee them.
    std::seed_seq seed{spec.seed, uint64_t{i}};
    if (s.program != "server") n.board.noise.emplace(seed);
    const Time bit = 1'000'000 / s.parameters.kbps * kNs;
    for (auto* fibre : {&n.there, &n.back}) {
      *fibre = std::make_unique<Fibre>(s.fibreKm, bit, random());
      (*fibre)->optics() = s.optics;
      (*fibre)->changed();
    }
    const bool isOnRing = i < ringSize_;
    if (isOnRing) window_ = std::min(window_, n.there->delay() - Fibre::kEarliest);
    for (auto [program, at] : {std::pair("server", &plant_), std::pair("gateway", &master_)}) {
      if (s.program != program) continue;
      if (*at)
        throw UserError(std::string("the ring has two nodes with host '") + program + "', but may have one.");
      *at = i;
      n.cable.emplace(*n.slave);
    }
    if (s.eeprom) n.slave->setEeprom(std::make_unique<Eeprom>(*s.eepromChip, *s.eeprom));
    if (!s.pair.empty()) {
      window_ = std::min(window_, Pair::kDelay);
      pairs_[s.pair].connect(*n.slave);
    }
    n.slave->setReset(true);
    n.resetEnd = kReset;
    if (!isOnRing) continue;
    n.slave->onLight = [this, i](int port, LightEdge edge) {
      const size_t before = (i + ringSize_ - 1) % ringSize_;
      (port == 1 ? *nodes_[i]->there : *nodes_[before]->back).launch(edge, phase_);
    };
  }
  if (!spec.closed)
    for (auto* fibre : {&nodes_[ringSize_ - 1]->there, &nodes_[ringSize_ - 1]->back})
      (*fibre)->setWhole(false);
  workers_.emplace(std::max<size_t>(1, std::min(options.processors, size())),
                   [this](size_t processor) { share(processor); });
}

std::unique_ptr<Host> Ring::makeHost(size_t i) {
  const RingNodeSpec& s = spec_.nodes[i];
  if (s.program == "node") return std::make_unique<RingNodeHost>(nodes_[i]->board, s.parameters);
  if (s.program == "server") {
    ring_server_parameters parameters = options_.server;
    parameters.node = s.parameters;
    return std::make_unique<RingServerHost>(nodes_[i]->board, parameters);
  }
  if (s.program == "gateway") return std::make_unique<RingGatewayHost>(nodes_[i]->board, s.parameters);
  if (s.program == "can") return std::make_unique<CanHost>(nodes_[i]->board, s.parameters, i >= ringSize_);
  return nullptr;
}

void Ring::holdPair(const std::string& name, bool dominant) {
  const auto pair = pairs_.find(name);
  if (pair == pairs_.end()) throw UserError("there is no twisted pair '" + name + "'.");
  pair->second.hold(dominant, now_);
}

void Ring::setPower(size_t i, bool on) {
  Node& n = *nodes_[i];
  if (n.powered == on) return;
  n.powered = on;
  n.slave->setHost(nullptr);
  if (on) n.slave->standStill(now_);
  if (n.cable) n.cable->setPower(on, now_);
  if (on) {
    n.slave->setReset(true);
    n.resetEnd = now_ + kReset;
    n.boots = true;
  } else {
    if (i < ringSize_)
      for (int port : {0, 1}) n.slave->onLight(port, {now_, false});
    for (auto& [name, pair] : pairs_) pair.release(*n.slave, now_);
    n.slave->loseLevels(now_);
  }
}

void Ring::setHost(size_t i, bool runs) {
  if (!powered(i)) throw UserError("node " + std::to_string(i + 1) + " has no power.");
  Node& n = *nodes_[i];
  // At power-on the host begins behind the reset.
  if (n.resetEnd != kNever && !n.slave->host()) n.boots = runs;
  else n.slave->setHost(runs ? makeHost(i) : nullptr);
}

void Ring::resetController(size_t i) {
  node(i).setReset(true);
  nodes_[i]->resetEnd = now_ + kReset;
}

Fibre& Ring::into(size_t i, int port) {
  return port == 1 ? *nodes_[i]->back : *nodes_[(i + ringSize_ - 1) % ringSize_]->there;
}

void Ring::runNode(Node& n, size_t i) {
  const Time end = now_ + window_;
  if (i < ringSize_)
    for (int port : {0, 1}) into(i, port).deliver(n.slave->light(port), 1 - phase_, now_);
  if (!n.powered) {
    for (int port : {0, 1}) keepLast(n.slave->light(port));
    keepLast(n.slave->pairLevels());
    return;
  }
  if (n.resetEnd != kNever && now_ >= n.resetEnd) {
    n.resetEnd = kNever;
    n.slave->setReset(false);
    if (n.boots) n.slave->setHost(makeHost(i));
    n.boots = false;
  }
  for (;;) {
    const bool isCable = n.cable && n.cable->next() < n.slave->next;
    if ((isCable ? n.cable->next() : n.slave->next) >= end) break;
    if (isCable) n.cable->step();
    else n.slave->step();
  }
}

void Ring::share(size_t processor) {
  for (size_t i = processor; i < size(); i += workers_->count()) runNode(*nodes_[i], i);
}

void Ring::advance() {
  workers_->run();
  now_ += window_;
  phase_ = 1 - phase_;
  for (auto& [name, pair] : pairs_) pair.deliver();
}

uint64_t Ring::coreCycles() const {
  uint64_t sum = 0;
  for (const auto& n : nodes_) sum += n->slave->cycles();
  return sum;
}
