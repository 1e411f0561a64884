#include "core/network_file.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "core/host.h"
#include "core/model.h"
#include "core/user_error.h"

namespace {
using nlohmann::json;

// Checks one slave's object key by key; `where` begins every complaint.
class SlaveReader {
 public:
  SlaveReader(const std::string& networkPath, size_t index)
      : folder_(std::filesystem::path(networkPath).parent_path()),
        where_("slave " + std::to_string(index) + " of the network '" + networkPath + "'") {}

  SlaveSpec read(const json& object) {
    if (!object.is_object()) bad("is not a JSON object");
    SlaveSpec spec;
    bool saveInPlace = false;
    for (const auto& [key, value] : object.items()) {
      if (key == "preset") spec.preset = text(key, value);
      else if (key == "eeprom") spec.eepromPath = (folder_ / text(key, value)).string();
      else if (key == "eeprom_chip") spec.eepromChip = chip(text(key, value));
      else if (key == "eeprom_save" && value.is_boolean()) saveInPlace = value.get<bool>();
      else if (key == "eeprom_save") spec.eepromSave = (folder_ / text(key, value)).string();
      else if (key == "host") spec.host.program = program(text(key, value));
      else if (key == "host_delay_us") spec.host.delayUs = number(key, value, 0, 1e6);
      else if (key == "host_replies") spec.host.replies = messages(key, value);
      else if (key == "cable_ns") spec.cableNs = number(key, value, 0, 1e6);
      else if (key == "clock_ppm") spec.clockPpm = number(key, value, -1000, 1000);
      else
        bad("has the unknown key '" + key +
            "'; known: preset, eeprom, eeprom_chip, eeprom_save, host, host_delay_us, host_replies, "
            "cable_ns, clock_ppm");
    }
    if (spec.preset.empty()) bad("has no preset");
    findPreset(spec.preset);
    if (spec.eepromPath.empty()) {
      if (spec.eepromChip || saveInPlace || !spec.eepromSave.empty())
        bad("says how its EEPROM is, but names no image");
      return spec;
    }
    std::ifstream file(spec.eepromPath, std::ios::binary);
    if (!file || std::filesystem::is_directory(spec.eepromPath))
      bad("names the EEPROM image '" + spec.eepromPath + "', which cannot be read");
    spec.eeprom.emplace(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    const size_t size = spec.eeprom->size();
    const EepromChip* fitting = eepromChipFor(size);
    if (!spec.eepromChip) spec.eepromChip = fitting;
    if (!spec.eepromChip)
      bad("names the EEPROM image '" + spec.eepromPath + "', whose " + std::to_string(size) +
          " bytes no known chip holds");
    if (size > spec.eepromChip->bytes)
      bad("names the EEPROM image '" + spec.eepromPath + "', whose " + std::to_string(size) +
          " bytes do not fit into the " + std::to_string(spec.eepromChip->bytes) + " of a " +
          spec.eepromChip->name);
    if (saveInPlace) spec.eepromSave = spec.eepromPath;
    if (!spec.eepromSave.empty() && !std::ofstream(spec.eepromSave, std::ios::binary | std::ios::app))
      bad("wants its EEPROM saved to '" + spec.eepromSave + "', which cannot be written");
    return spec;
  }

 private:
  [[noreturn]] void bad(const std::string& why) const { throw UserError(where_ + " " + why + "."); }
  std::string text(const std::string& key, const json& value) const {
    if (!value.is_string()) bad("has " + key + " " + value.dump() + ", but it must be a string");
    return value.get<std::string>();
  }
  const EepromChip* chip(const std::string& name) const {
    const EepromChip* c = findEepromChip(name);
    if (!c) bad("has the eeprom_chip '" + name + "'; known: 24C16, 24C32");
    return c;
  }
  std::string program(const std::string& name) const {
    try {
      makeHost({name, 0, {}});
    } catch (const UserError&) {
      bad("has the host program '" + name + "'; known: none, io, alive, mute");
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
  double number(const std::string& key, const json& value, double low, double high) const {
    if (!value.is_number() || value.get<double>() < low || value.get<double>() > high)
      bad("has " + key + " " + value.dump() + ", but it must be a number from " +
          json(std::llround(low)).dump() + " to " + json(std::llround(high)).dump());
    return value.get<double>();
  }

  std::filesystem::path folder_;
  std::string where_;
};
}  // namespace

std::vector<SlaveSpec> readNetwork(const std::string& path) {
  std::ifstream file(path);
  if (!file || std::filesystem::is_directory(path))
    throw UserError("cannot read the network '" + path + "'.");
  json root;
  try {
    root = json::parse(file);
  } catch (const json::parse_error& e) {
    throw UserError("the network '" + path + "' is not valid JSON at byte " + std::to_string(e.byte) + ".");
  }
  if (!root.is_object() || !root.contains("slaves") || !root["slaves"].is_array() || root["slaves"].empty())
    throw UserError("the network '" + path +
                    "' must be an object with a list 'slaves' of one slave or more.");
  for (const auto& [key, value] : root.items())
    if (key != "slaves")
      throw UserError("the network '" + path + "' has the unknown key '" + key + "'; known: slaves.");
  std::vector<SlaveSpec> slaves;
  for (const json& object : root["slaves"]) slaves.push_back(SlaveReader(path, slaves.size()).read(object));
  return slaves;
}

std::string eepromProblem(const Bytes& image) {
  if (image.size() < 16) return "it has only " + std::to_string(image.size()) + " of 16 bytes";
  if (image[14] == 0xa4 && image[15] == 0x88) return "";  // checksum switched off
  const uint8_t wanted = siiCrc8(image.data(), 14);
  char text[64];
  std::snprintf(text, sizeof text, "its checksum is 0x%02x where 0x%02x belongs", image[14], wanted);
  return image[14] == wanted ? "" : text;
}
