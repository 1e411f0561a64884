#include "core/network_file.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "core/host.h"
#include "core/json_reader.h"
#include "core/model.h"
#include "core/user_error.h"

namespace {
using nlohmann::json;

class Reader : public JsonReader {
 public:
  using JsonReader::JsonReader;

  // Whether the key is one of a cable.
  bool readCable(const std::string& key, const json& value, CableSpec& spec) const {
    if (key == "cable_ns") spec.ns = number(key, value, 0, 1e6);
    else if (key == "bit_errors") spec.bitErrors = whole(key, value, 1'000'000'000'000);
    else if (key == "link_drops_per_s") spec.dropsPerSecond = number(key, value, 0, 1e5);
    else if (key == "link_drop_us") spec.dropUs = number(key, value, 1, 1e6);
    else return false;
    return true;
  }
};

class SlaveReader : private Reader {
 public:
  SlaveReader(const std::string& networkPath, size_t index)
      : Reader("slave " + std::to_string(index) + " of the network '" + networkPath + "'"),
        folder_(std::filesystem::path(networkPath).parent_path()),
        index_(index) {}

  SlaveSpec read(const json& object) {
    if (!object.is_object()) bad("is not a JSON object");
    SlaveSpec spec;
    if (index_ > 0) spec.behind = index_ - 1;
    bool saveInPlace = false;
    for (const auto& [key, value] : object.items()) {
      if (key == "preset") spec.preset = text(key, value);
      else if (key == "eeprom") spec.eepromPath = (folder_ / text(key, value)).string();
      else if (key == "eeprom_chip") spec.eepromChip = chip(text(key, value));
      else if (key == "eeprom_save" && value.is_boolean()) saveInPlace = value.get<bool>();
      else if (key == "eeprom_save") spec.eepromSave = (folder_ / text(key, value)).string();
      else if (key == "host") spec.host.program = program(text(key, value));
      else if (key == "host_delay_us") spec.host.delayUs = number(key, value, 0, 1e6);
      else if (key == "wired" && value.is_boolean()) spec.wired = value.get<bool>();
      else if (key == "host_replies") spec.host.replies = messages(key, value);
      else if (readCable(key, value, spec.cable)) continue;
      else if (key == "behind") spec.behind = whole(key, value, index_ == 0 ? 0 : index_ - 1);
      else if (key == "port") spec.port = static_cast<int>(whole(key, value, 3));
      else if (key == "clock_ppm") spec.clockPpm = number(key, value, -1000, 1000);
      else if (key == "drift_ppm") spec.driftPpm = number(key, value, 0, 1000);
      else if (key == "drift_s") spec.driftSeconds = number(key, value, 0.001, 1e6);
      else
        bad("has the unknown key '" + key +
            "'; known: preset, eeprom, eeprom_chip, eeprom_save, host, host_delay_us, host_replies, wired, "
            "behind, port, cable_ns, bit_errors, link_drops_per_s, link_drop_us, clock_ppm, drift_ppm, "
            "drift_s");
    }
    if (spec.preset.empty()) bad("has no preset");
    if (index_ == 0 && (object.contains("behind") || object.contains("port")))
      bad("is behind the master, so that it has neither 'behind' nor 'port'");
    if (!findPreset(spec.preset).info.hasHost && spec.host.program != "none")
      bad("has the host program '" + spec.host.program + "', but its preset '" + spec.preset +
          "' has no host");
    if (spec.eepromPath.empty()) {
      if (spec.eepromChip || saveInPlace || !spec.eepromSave.empty())
        bad("says how its EEPROM is, but names no image");
      return spec;
    }
    spec.eeprom = readEeprom(spec.eepromPath, spec.eepromChip, [&](const std::string& why) { bad(why); });
    if (saveInPlace) spec.eepromSave = spec.eepromPath;
    if (!spec.eepromSave.empty() && !std::ofstream(spec.eepromSave, std::ios::binary | std::ios::app))
      bad("wants its EEPROM saved to '" + spec.eepromSave + "', which cannot be written");
    return spec;
  }

 private:
  const EepromChip* chip(const std::string& name) const {
    const EepromChip* c = findEepromChip(name);
    if (!c) bad("has the eeprom_chip '" + name + "'; known: 24C16, 24C32");
    return c;
  }
  std::string program(const std::string& name) const {
    try {
      makeHost({name, 0, {}});
    } catch (const UserError& e) {
      const std::string sentence = e.what(), known = sentence.substr(sentence.rfind(';'));
      bad("has the host program '" + name + "'" + known.substr(0, known.size() - 1));
    }
    return name;
  }
  std::vector<Bytes> messages(const std::string& key, const json& value) const {
    std::vector<Bytes> all;
    const char* wrong = ", but it must be a list of strings of hex digits, two per byte";
    if (!value.is_array()) bad("has " + key + " " + value.dump() + wrong);
    for (const json& item : value) {
      const std::string digits = item.is_string() ? item.get<std::string>() : "?";
      if (digits.size() % 2 || digits.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos)
        bad("has " + key + " " + item.dump() + wrong);
      Bytes bytes;
      for (size_t i = 0; i < digits.size(); i += 2)
        bytes.push_back(static_cast<uint8_t>(std::stoul(digits.substr(i, 2), nullptr, 16)));
      all.push_back(bytes);
    }
    return all;
  }

  std::filesystem::path folder_;
  size_t index_;
};

// The cable that makes a ring; `true`: an ordinary one.
std::optional<CableSpec> readRing(const std::string& path, const json& value) {
  if (value.is_boolean()) return value.get<bool>() ? std::optional(CableSpec{}) : std::nullopt;
  const Reader reader("the ring of the network '" + path + "'");
  if (!value.is_object()) reader.bad("is neither true, false, nor a JSON object");
  CableSpec cable;
  for (const auto& [key, item] : value.items())
    if (!reader.readCable(key, item, cable))
      reader.bad("has the unknown key '" + key +
                 "'; known: cable_ns, bit_errors, link_drops_per_s, link_drop_us");
  return cable;
}

// Each cable leads to a port that there is, and no other cable is there.
void checkPorts(const NetworkSpec& network, const std::string& path) {
  std::set<std::pair<size_t, int>> taken;
  const auto take = [&](const std::string& whose, size_t slave, int port) {
    const std::string end = "port " + std::to_string(port) + " of slave " + std::to_string(slave);
    const PresetInfo& preset = findPreset(network.slaves[slave].preset).info;
    if (port >= preset.ports)
      throw UserError("the cable of " + whose + " in the network '" + path + "' leads to " + end +
                      ", whose preset '" + preset.name + "' has " + std::to_string(preset.ports) + ".");
    if (!taken.insert({slave, port}).second)
      throw UserError("two cables of the network '" + path + "' lead to " + end + ".");
  };
  const size_t size = network.slaves.size();
  for (size_t i = 0; i < size; ++i) take("the slave itself", i, 0);
  for (size_t i = 1; i < size; ++i)
    take("slave " + std::to_string(i), network.slaves[i].behind, network.slaves[i].port);
  if (network.ring) take("the ring", size - 1, 1);
}
}  // namespace

NetworkSpec readNetwork(const std::string& path) {
  const json root = readJson(path);
  if (!root.is_object() || !root.contains("slaves") || !root["slaves"].is_array() || root["slaves"].empty())
    throw UserError("the network '" + path +
                    "' must be an object with a list 'slaves' of one slave or more.");
  const Reader reader("the network '" + path + "'");
  NetworkSpec network;
  for (const auto& [key, value] : root.items()) {
    if (key == "slaves") continue;
    else if (key == "seed") network.seed = reader.whole(key, value, UINT32_MAX);
    else if (key == "master_ppm") network.masterPpm = reader.number(key, value, -1000, 1000);
    else if (key == "ring") network.ring = readRing(path, value);
    else reader.bad("has the unknown key '" + key + "'; known: slaves, ring, master_ppm, seed");
  }
  for (const json& object : root["slaves"])
    network.slaves.push_back(SlaveReader(path, network.slaves.size()).read(object));
  checkPorts(network, path);
  return network;
}

Bytes readEeprom(const std::string& path, const EepromChip*& chip,
                 const std::function<void(const std::string&)>& bad) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path))
    bad("names the EEPROM image '" + path + "', which cannot be read");
  Bytes image{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const std::string size = std::to_string(image.size());
  if (!chip) chip = eepromChipFor(image.size());
  if (!chip) bad("names the EEPROM image '" + path + "', whose " + size + " bytes no known chip holds");
  if (image.size() > chip->bytes)
    bad("names the EEPROM image '" + path + "', whose " + size + " bytes do not fit into the " +
        std::to_string(chip->bytes) + " of a " + chip->name);
  return image;
}

std::string eepromProblem(const Bytes& image) {
  if (image.size() < 16) return "it has only " + std::to_string(image.size()) + " of 16 bytes";
  if (image[14] == 0xa4 && image[15] == 0x88) return "";  // checksum switched off
  const uint8_t wanted = siiCrc8(image.data(), 14);
  char text[64];
  std::snprintf(text, sizeof text, "its checksum is 0x%02x where 0x%02x belongs", image[14], wanted);
  return image[14] == wanted ? "" : text;
}
