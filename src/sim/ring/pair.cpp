#include "ring/pair.h"

#include <algorithm>

void Pair::connect(Slave& slave) {
  members_.push_back(std::make_unique<Member>());
  Member* m = members_.back().get();
  m->slave = &slave;
  slave.onPair = [m](Slave::LightEdge edge) { m->driven.push_back(edge); };
}

void Pair::release(const Slave& slave, Time now) {
  for (auto& m : members_)
    if (m->slave == &slave) m->driven.push_back({now, true});
}

void Pair::hold(bool dominant, Time now) {
  const auto stuck = std::find_if(members_.begin(), members_.end(), [](const auto& m) { return !m->slave; });
  Member* m =
      stuck == members_.end() ? members_.emplace_back(std::make_unique<Member>()).get() : stuck->get();
  m->driven.push_back({now, !dominant});
}

void Pair::deliver() {
  struct Change {
    Time at;
    Member* member;
    bool level;
  };
  std::vector<Change> changes;
  for (auto& m : members_) {
    for (const Slave::LightEdge& e : m->driven) changes.push_back({e.at, m.get(), e.level});
    m->driven.clear();
  }
  std::stable_sort(changes.begin(), changes.end(),
                   [](const Change& a, const Change& b) { return a.at < b.at; });
  for (const Change& c : changes) {
    c.member->level = c.level;
    const bool level = std::all_of(members_.begin(), members_.end(), [](const auto& m) { return m->level; });
    if (level == level_) continue;
    level_ = level;
    for (auto& m : members_)
      if (m->slave) m->slave->pairLevels().push_back({c.at + kDelay, level});
  }
}
