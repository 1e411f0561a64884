#include "ring/doors.h"

#include "core/user_error.h"
#include "ring/cannelloni.h"
#include "ring/cannelloni_stream.h"
#include "ring/linux_can.h"
#include "ring/recorder.h"
#include "ring/slcan.h"
#include "ring/socketcand.h"

namespace {
uint16_t port(const std::string& text) {
  const bool good = !text.empty() && text.size() <= 5 &&
                    text.find_first_not_of("0123456789") == std::string::npos && std::stoul(text) >= 1 &&
                    std::stoul(text) <= 65535;
  if (!good) throw UserError("'" + text + "' is no port from 1 to 65535.");
  return static_cast<uint16_t>(std::stoul(text));
}
}  // namespace

size_t Doors::nodeOf(const std::string& option, std::string& value) const {
  const size_t equals = option.find('=');
  const std::string node = option.substr(0, equals);
  if (equals == std::string::npos || equals + 1 == option.size())
    throw UserError("the door '" + option + "' must be a node, =, and where it is.");
  value = option.substr(equals + 1);
  const bool isNumber =
      !node.empty() && node.size() <= 3 && node.find_first_not_of("0123456789") == std::string::npos;
  if (!isNumber || std::stoul(node) < 1 || std::stoul(node) > ring_.size())
    throw UserError("the door '" + option + "' leads to node '" + node + "', but there are nodes 1 to " +
                    std::to_string(ring_.size()) + ".");
  const size_t i = std::stoul(node) - 1;
  if (ring_.spec(i).program != "can")
    throw UserError("the door '" + option + "' leads to node " + node + ", whose host is '" +
                    ring_.spec(i).program + "', but must be 'can'.");
  return i;
}

Doors::Doors(Ring& ring, const Options& options) : ring_(ring), doors_(ring.size()), first_(ring.size()) {
  std::string value;
  for (const std::string& o : options.slcan) {
    const size_t i = nodeOf(o, value);
    add(i, std::make_unique<SlcanDoor>(value));
  }
  for (const std::string& o : options.socketcand) {
    const size_t i = nodeOf(o, value);
    add(i, std::make_unique<SocketcandDoor>(port(value)));
  }
  for (const std::string& o : options.cannelloni) {
    const size_t i = nodeOf(o, value), colon = value.find(':');
    const uint16_t peer = colon == std::string::npos ? 0 : port(value.substr(colon + 1));
    const uint16_t own = port(value.substr(0, colon));
    add(i, std::make_unique<CannelloniDoor>(own, peer));
    add(i, std::make_unique<CannelloniStreamDoor>(own));
  }
  for (const std::string& o : options.socketcan) {
    const size_t i = nodeOf(o, value);
    add(i, std::make_unique<LinuxCanDoor>(value));
  }
  for (const std::string& o : options.pcap) {
    const size_t i = nodeOf(o, value);
    add(i, std::make_unique<PcapRecorder>(value));
  }
  for (const std::string& o : options.candump) {
    const size_t i = nodeOf(o, value);
    add(i, std::make_unique<CandumpRecorder>(value));
  }
}

void Doors::serve() {
  for (size_t i = 0; i < doors_.size(); ++i) {
    CanHost* port = ring_.canProgram(i);  // its events are taken also where there is no door
    if (port)
      for (const CanEvent& e : port->events())
        for (const auto& door : doors_[i]) door->happened(e);
    // Behind the door that has sent last, so that the next place at a full port is another one's.
    const size_t count = doors_[i].size(), first = first_[i];
    for (size_t k = first; k < first + count; ++k) {
      const size_t backlog = port ? port->backlog() : 0;
      doors_[i][k % count]->serve(port);
      if (port && port->backlog() > backlog) first_[i] = k % count + 1;
    }
  }
}

nlohmann::ordered_json Doors::status() const {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (size_t i = 0; i < doors_.size(); ++i)
    for (const auto& door : doors_[i]) {
      nlohmann::ordered_json one = {{"node", i + 1},
                                    {"door", door->name()},
                                    {"malformed", door->malformed()},
                                    {"dropped", door->dropped()}};
      if (const auto* c = dynamic_cast<const CannelloniDoor*>(door.get())) one["gaps"] = c->gaps();
      all.push_back(one);
    }
  return all;
}
