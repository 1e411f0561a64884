// Checks a JSON file key by key; what is wrong is a UserError.
#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "core/user_error.h"

// `where` begins every complaint.
class JsonReader {
 public:
  explicit JsonReader(std::string where) : where_(std::move(where)) {}
  [[noreturn]] void bad(const std::string& why) const { throw UserError(where_ + " " + why + "."); }

  std::string text(const std::string& key, const nlohmann::json& value) const {
    if (!value.is_string()) bad("has " + key + " " + value.dump() + ", but it must be a string");
    return value.get<std::string>();
  }
  bool flag(const std::string& key, const nlohmann::json& value) const {
    if (!value.is_boolean()) bad("has " + key + " " + value.dump() + ", but it must be true or false");
    return value.get<bool>();
  }
  double number(const std::string& key, const nlohmann::json& value, double low, double high) const {
    if (!value.is_number() || value.get<double>() < low || value.get<double>() > high) {
      const auto shown = [](double x) {
        return x == std::floor(x) ? nlohmann::json(std::llround(x)) : nlohmann::json(x);
      };
      bad("has " + key + " " + value.dump() + ", but it must be a number from " + shown(low).dump() + " to " +
          shown(high).dump());
    }
    return value.get<double>();
  }
  uint64_t whole(const std::string& key, const nlohmann::json& value, uint64_t high, uint64_t low = 0) const {
    if (!value.is_number_unsigned() || value.get<uint64_t>() > high || value.get<uint64_t>() < low)
      bad("has " + key + " " + value.dump() + ", but it must be a whole number from " + std::to_string(low) +
          " to " + std::to_string(high));
    return value.get<uint64_t>();
  }

 private:
  std::string where_;
};

// The contents of a network file.
inline nlohmann::json readJson(const std::string& path) {
  std::ifstream file(path);
  if (!file || std::filesystem::is_directory(path))
    throw UserError("cannot read the network '" + path + "'.");
  try {
    return nlohmann::json::parse(file);
  } catch (const nlohmann::json::parse_error& e) {
    throw UserError("the network '" + path + "' is not valid JSON at byte " + std::to_string(e.byte) + ".");
  }
}
