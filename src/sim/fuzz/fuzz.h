// Plays test vectors on one slave and compares what it does (format: README.md).
#pragma once

#include <cstdint>
#include <deque>
#include <iosfwd>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/bench.h"
#include "fuzz/vectors.h"

class Fuzz {
 public:
  // `preset` empty: the one each H line names.
  explicit Fuzz(std::string preset) : wantedPreset_(std::move(preset)) {}

  // Plays all lines. True if nothing differed; else difference() tells the first difference. Throws UserError
  // on a bad vector.
  bool play(std::istream& vectors);

  const std::string& difference() const { return difference_; }
  uint64_t frames() const { return frames_; }
  uint64_t bytesCompared() const { return bytes_; }
  uint64_t cycles() const { return cycles_ + (bench_ ? bench_->slave().cycles() : 0); }

 private:
  struct Sent {  // an F line, kept for messages
    uint64_t line;
    std::string id;
    int port;
    std::vector<uint8_t> nibbles;
    std::string errors;
    int guard = -1;  // payload byte where the guard of an acknowledgement stands
    uint16_t guardIs = 0;
  };
  struct Expected {
    uint64_t line;
    std::shared_ptr<Sent> cause;
    std::vector<uint8_t> nibbles;  // preamble, SFD and payload
    bool free = false;             // only preamble and length count
    int time = -1;                 // payload nibble where the time of an event stands
  };

  void line(VectorLine& v);
  void header(VectorLine& v);
  void frame(VectorLine& v);
  void expect(VectorLine& v);
  void read(VectorLine& v);
  void onFrame(int port, NibbleFrame& frame);
  bool takeTime(Expected& e, const NibbleFrame& frame);
  void waitIdle();
  int port(VectorLine& v) const;
  void differ(const std::string& what, uint64_t line, const Sent* cause);
  bool failed() const { return !difference_.empty(); }
  Bench& bench();

  std::string wantedPreset_, seed_;
  std::unique_ptr<Bench> bench_;
  std::vector<std::deque<Expected>> expected_;  // per port
  std::shared_ptr<Sent> current_;               // the last F line
  std::map<unsigned, uint64_t> eventTimes_;     // of all events with a time, by their numbers
  bool reading_ = false;                        // the last line was an R line
  uint64_t lineNumber_ = 0, frames_ = 0, bytes_ = 0, cycles_ = 0;
  std::string difference_;
};
