// The levels inside the nodes of a ring as a VCD (TL-03).
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "ring/ring.h"

class LevelRecorder {
 public:
  LevelRecorder(Ring& ring, const std::string& path);
  ~LevelRecorder();
  // Writes what has happened before now. UserError if it cannot.
  void flush();

 private:
  struct Change {
    Time at;
    size_t node;
    unsigned levels;
  };
  void write(const Change& change);

  Ring& ring_;
  std::string path_;
  std::FILE* file_;
  std::vector<std::vector<Change>> changes_;  // by node, each filled by its processor
  std::vector<unsigned> last_;
  Time at_ = 0;
};
