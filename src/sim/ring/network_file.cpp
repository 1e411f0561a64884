#include "ring/network_file.h"

#include <filesystem>

#include "core/json_reader.h"
#include "core/model.h"
#include "core/network_file.h"

namespace {
using nlohmann::json;

constexpr size_t kMostNodes = 125;

class NodeReader : private JsonReader {
 public:
  NodeReader(const std::string& path, size_t number)
      : JsonReader("node " + std::to_string(number) + " of the ring '" + path + "'"),
        path_(path) {}

  void read(const json& object, RingNodeSpec& spec) const {
    if (!object.is_object()) bad("is not a JSON object");
    ring_node_parameters& p = spec.parameters;
    for (const auto& [key, value] : object.items()) {
      if (key == "address") p.address = static_cast<uint8_t>(whole(key, value, RING_LAST_ADDRESS, 1));
      else if (key == "preset") spec.preset = text(key, value);
      else if (key == "host") spec.program = program(text(key, value));
      else if (key == "home") p.home = flag(key, value);
      else if (key == "device_type") p.device_type = static_cast<uint16_t>(whole(key, value, UINT16_MAX));
      else if (key == "version") p.version = static_cast<uint8_t>(whole(key, value, UINT8_MAX));
      else if (key == "clock_ppm") spec.clockPpm = number(key, value, -10'000, 10'000);
      else if (key == "fibre_km") spec.fibreKm = number(key, value, 0, 1000);
      else if (key == "pair") spec.pair = text(key, value);
      else if (key == "pair_kbps") p.pair_kbps = static_cast<uint16_t>(whole(key, value, 1000, 5));
      else if (key == "bridge") p.bridge = flag(key, value);
      else if (key == "eeprom") spec.eeprom = image(text(key, value), spec.eepromChip);
      else if (key == "bit_errors") spec.optics.bitErrors = whole(key, value, 1'000'000'000'000);
      else
        bad("has the unknown key '" + key +
            "'; known: address, preset, host, eeprom, home, device_type, version, clock_ppm, fibre_km, "
            "bit_errors, pair, pair_kbps, bridge");
    }
  }
  [[noreturn]] void refuse(const std::string& why) const { bad(why); }
  // What can be said only when all keys are known.
  void check(RingNodeSpec& spec) const {
    const PresetInfo& info = findPreset(spec.preset).info;
    const auto parameter = [&](const char* name) {
      const auto found = info.parameters.find(name);
      return found == info.parameters.end() ? 0 : found->second;
    };
    if (parameter("ring") == 0) bad("has preset '" + spec.preset + "', which is no node of a fibre ring");
    if (spec.parameters.relay && parameter("ring") < 2)
      bad("has preset '" + spec.preset + "', which has no relay mode");
    const unsigned kbps = spec.parameters.kbps, core = static_cast<unsigned>(info.coreClockMhz);
    // 25 quanta of whole core cycles, or bits of a link of whole ones.
    const unsigned most = core * (spec.parameters.relay ? 1000 : 40);
    if (most % kbps != 0)
      bad("cannot have " + std::to_string(kbps) + " kbit/s: with a core clock of " + std::to_string(core) +
          " MHz " + std::to_string(most) + " must be a multiple of it");
    spec.parameters.core_mhz = static_cast<uint8_t>(core);
    if (spec.program == "server" && parameter("plant") == 0)
      bad("has the host 'server', but preset '" + spec.preset + "' has no port to the plant network");
    const bool isGateway = spec.program == "gateway";
    if ((spec.program == "server" || isGateway) && spec.parameters.address != 1)
      bad("has the host '" + spec.program + "' and address " + std::to_string(spec.parameters.address) +
          ", but its address is 1");
    const bool isSlave = info.parameters.at("role") == 0;
    if (isGateway && !isSlave)
      bad("has the host 'gateway', but preset '" + spec.preset + "' is no EtherCAT slave");
    if (isSlave && spec.program != "gateway" && spec.program != "none")
      bad("has preset '" + spec.preset + "', whose host is 'gateway' or 'none'");
    if (isGateway != spec.eeprom.has_value())
      bad(isGateway ? "has the host 'gateway', but no 'eeprom'" : "has an 'eeprom', but no host 'gateway'");
    if (spec.pair.empty() && (spec.parameters.bridge || spec.parameters.pair_kbps != 0))
      bad("has a bridge or a bit rate of a pair, but is on none");
    if (spec.pair.empty()) return;
    if (parameter("canPorts") < 2) bad("has preset '" + spec.preset + "', which has no twisted pair");
    if (spec.parameters.bridge && parameter("bridge") == 0)
      bad("has preset '" + spec.preset + "', which has no bridge");
    if (spec.parameters.bridge && (spec.program == "can" || spec.program == "none"))
      bad("has a bridge, but the host '" + spec.program + "', which sets none up");
    if (spec.parameters.pair_kbps == 0) spec.parameters.pair_kbps = 1000;
    if (core * 40 % spec.parameters.pair_kbps != 0)
      bad("cannot have " + std::to_string(spec.parameters.pair_kbps) + " kbit/s on its pair");
  }

 private:
  std::string program(const std::string& name) const {
    if (name != "node" && name != "can" && name != "none" && name != "server" && name != "gateway")
      bad("has the host '" + name + "'; known: node, can, none, server, gateway");
    return name;
  }
  // Relative to the network file.
  Bytes image(const std::string& name, const EepromChip*& chip) const {
    const auto folder = std::filesystem::path(path_).parent_path();
    return readEeprom((folder / name).string(), chip, [this](const std::string& why) { bad(why); });
  }
  std::string path_;
};

std::string mode(const JsonReader& reader, const json& value) {
  const std::string mode = reader.text("mode", value);
  if (mode != "bus" && mode != "relay") reader.bad("has the mode '" + mode + "'; known: bus, relay");
  return mode;
}
}  // namespace

RingSpec readRing(const std::string& path) {
  const json root = readJson(path);
  const JsonReader reader("the ring '" + path + "'");
  if (!root.is_object() || !root.contains("nodes")) reader.bad("must be an object with 'nodes'");
  RingSpec ring;
  RingNodeSpec each;
  each.parameters.relay = true;
  each.parameters.pd_ms = 100;
  if (root.contains("mode")) each.parameters.relay = mode(reader, root["mode"]) == "relay";
  each.parameters.kbps = each.parameters.relay ? 2000 : 100;
  for (const auto& [key, value] : root.items()) {
    if (key == "nodes" || key == "mode" || key == "each" || key == "controllers") continue;
    else if (key == "kbps") {
      const bool relay = each.parameters.relay;
      each.parameters.kbps =
          static_cast<uint16_t>(reader.whole(key, value, relay ? 2000 : 1000, relay ? 400 : 5));
    } else if (key == "confirm_us") {
      each.parameters.confirm_us = static_cast<uint32_t>(reader.whole(key, value, 655'350, 10));
    } else if (key == "pd_ms") {
      each.parameters.pd_ms = static_cast<uint16_t>(reader.whole(key, value, 1000, 1));
    } else if (key == "hello_ms") {
      each.parameters.hello_ms = static_cast<uint16_t>(reader.whole(key, value, 1000, 1));
    } else if (key == "up_ms") {
      each.parameters.up_ms = static_cast<uint8_t>(reader.whole(key, value, 255, 1));
    } else if (key == "closed") {
      ring.closed = reader.flag(key, value);
    } else if (key == "seed") {
      ring.seed = reader.whole(key, value, UINT32_MAX);
    } else {
      reader.bad(
          "has the unknown key '" + key +
          "'; known: nodes, each, controllers, mode, kbps, confirm_us, pd_ms, hello_ms, up_ms, closed, seed");
    }
  }
  if (root.contains("each")) NodeReader(path, 0).read(root["each"], each);
  if (each.parameters.address != 0) reader.bad("has an address in 'each', but every node needs another one");
  const json& nodes = root["nodes"];
  const size_t count = nodes.is_array() ? nodes.size() : reader.whole("nodes", nodes, kMostNodes, 2);
  if (count < 2 || count > kMostNodes)
    reader.bad("has " + std::to_string(count) + " nodes, but there must be 2 to " +
               std::to_string(kMostNodes));
  for (size_t i = 0; i < count; ++i) {
    RingNodeSpec spec = each;
    const NodeReader node(path, i + 1);
    if (nodes.is_array()) node.read(nodes[i], spec);
    if (spec.parameters.address == 0) spec.parameters.address = static_cast<uint8_t>(i + 1);
    node.check(spec);
    ring.nodes.push_back(spec);
  }
  if (!root.contains("controllers")) return ring;
  if (!root["controllers"].is_array()) reader.bad("has 'controllers' that are no list");
  for (const json& object : root["controllers"]) {
    RingNodeSpec spec;
    spec.preset = "ring-node-tp";
    spec.program = "can";
    spec.parameters.kbps = 1000;  // of its ring, which leads nowhere
    const NodeReader node(path, count + ring.controllers.size() + 1);
    node.read(object, spec);
    if (spec.pair.empty() || spec.program != "can") node.refuse("must be on a pair, with host 'can'");
    node.check(spec);
    ring.controllers.push_back(spec);
  }
  return ring;
}
