// A line of test vectors as fields.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

// Splits a line at spaces and converts fields; every complaint is a UserError with the line number.
class VectorLine {
 public:
  VectorLine(std::string text, uint64_t number);
  VectorLine(const VectorLine&) = delete;  // the fields point into text_

  uint64_t number() const { return number_; }
  bool empty() const { return fields_.empty(); }
  char kind() const { return fields_[0][0]; }
  bool more() const { return at_ < fields_.size(); }
  std::string text();  // the next field
  long decimal(long low, long high);
  long hexNumber(long high);
  std::vector<uint8_t> nibbles();  // one hex digit each
  void done() const;               // nothing may be left
  [[noreturn]] void bad(const std::string& why) const;

 private:
  std::string_view next(const char* what);
  const std::string text_;
  std::vector<std::string_view> fields_;
  size_t at_ = 1;
  uint64_t number_;
};
