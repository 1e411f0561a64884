#include "ring/levels.h"

#include <algorithm>

#include "core/flush.h"
#include "core/user_error.h"

namespace {
constexpr const char* kNames[] = {"bus", "drive", "R1", "R2", "T1", "T2"};
constexpr size_t kLevels = std::size(kNames);

char levelOf(unsigned levels, size_t level) {
  if (levels == Slave::kNoLevels) return 'x';
  return levels >> level & 1 ? '1' : '0';
}

// Two printable characters are enough for 125 nodes.
std::string sign(size_t node, size_t level) {
  const size_t n = node * kLevels + level;
  constexpr size_t kFirst = '!', kSigns = '~' - '!' + 1;
  return {static_cast<char>(kFirst + n % kSigns), static_cast<char>(kFirst + n / kSigns)};
}
}  // namespace

LevelRecorder::LevelRecorder(Ring& ring, const std::string& path)
    : ring_(ring),
      path_(path),
      file_(std::fopen(path.c_str(), "w")),
      changes_(ring.size()),
      last_(ring.size()) {
  if (!file_) throw UserError("cannot write the levels '" + path + "'.");
  std::fprintf(file_, "$timescale 1ns $end\n$scope module ring $end\n");
  for (size_t i = 0; i < ring.size(); ++i) {
    std::fprintf(file_, "$scope module node%zu $end\n", i + 1);
    for (size_t l = 0; l < kLevels; ++l)
      std::fprintf(file_, "$var wire 1 %s %s $end\n", sign(i, l).c_str(), kNames[l]);
    std::fprintf(file_, "$upscope $end\n");
    ring.node(i).onLevels = [this, i](Time at, unsigned levels) { changes_[i].push_back({at, i, levels}); };
  }
  std::fprintf(file_, "$upscope $end\n$enddefinitions $end\n#0\n");
  for (size_t i = 0; i < ring.size(); ++i)
    for (size_t l = 0; l < kLevels; ++l) std::fprintf(file_, "0%s\n", sign(i, l).c_str());
}

LevelRecorder::~LevelRecorder() {
  try {
    flush();
  } catch (const UserError&) {  // it has been told
  }
  for (size_t i = 0; i < ring_.size(); ++i) ring_.node(i).onLevels = nullptr;
  std::fclose(file_);
}

void LevelRecorder::write(const Change& c) {
  if (c.at / kNs != at_) std::fprintf(file_, "#%lld\n", static_cast<long long>(at_ = c.at / kNs));
  for (size_t l = 0; l < kLevels; ++l)
    if (levelOf(c.levels, l) != levelOf(last_[c.node], l))
      std::fprintf(file_, "%c%s\n", levelOf(c.levels, l), sign(c.node, l).c_str());
  last_[c.node] = c.levels;
}

void LevelRecorder::flush() {
  std::vector<Change> all;
  for (auto& node : changes_) {
    all.insert(all.end(), node.begin(), node.end());
    node.clear();
  }
  std::stable_sort(all.begin(), all.end(), [](const Change& a, const Change& b) { return a.at < b.at; });
  for (const Change& c : all) write(c);
  ::flush(file_, "the levels '" + path_ + "'");
}
