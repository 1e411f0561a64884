#include "fuzz/vectors.h"

#include <charconv>

#include "core/user_error.h"

VectorLine::VectorLine(std::string text, uint64_t number) : text_(std::move(text)), number_(number) {
  std::string_view rest(text_);
  while (true) {
    const size_t from = rest.find_first_not_of(" \t\r");
    if (from == std::string_view::npos || rest[from] == '#') break;
    const size_t to = rest.find_first_of(" \t\r", from);
    fields_.push_back(rest.substr(from, to - from));
    if (to == std::string_view::npos) break;
    rest.remove_prefix(to);
  }
  if (!fields_.empty() && fields_[0].size() != 1)
    bad("starts with '" + std::string(fields_[0]) + "', not with one letter");
}

void VectorLine::bad(const std::string& why) const {
  throw UserError("vector line " + std::to_string(number_) + " " + why + ".");
}

std::string_view VectorLine::next(const char* what) {
  if (!more()) bad(std::string("lacks ") + what);
  return fields_[at_++];
}

std::string VectorLine::text() { return std::string(next("a field")); }

static long convert(const VectorLine& line, std::string_view field, int base, long low, long high) {
  long value = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value, base);
  if (error != std::errc() || end != field.data() + field.size() || value < low || value > high)
    line.bad("has '" + std::string(field) + "' where a number from " + std::to_string(low) + " to " +
             std::to_string(high) + " belongs");
  return value;
}

long VectorLine::decimal(long low, long high) { return convert(*this, next("a number"), 10, low, high); }
long VectorLine::hexNumber(long high) { return convert(*this, next("a hex number"), 16, 0, high); }

std::vector<uint8_t> VectorLine::nibbles() {
  std::vector<uint8_t> result;
  for (char c : next("nibbles")) {
    if (c >= '0' && c <= '9') result.push_back(c - '0');
    else if (c >= 'a' && c <= 'f') result.push_back(c - 'a' + 10);
    else if (c >= 'A' && c <= 'F') result.push_back(c - 'A' + 10);
    else bad(std::string("has '") + c + "' where a hex digit belongs");
  }
  return result;
}

void VectorLine::done() const {
  if (more()) bad("has more fields than it should, from '" + std::string(fields_[at_]) + "' on");
}
