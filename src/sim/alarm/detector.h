// A two-wire smoke detector on its line, as the comparators see it (DET-02).
#pragma once

#include "core/esc.h"

class SmokeDetector {
 public:
  enum class Line { whole, open, shorted };

  void setSmoke(bool on) { smoke_ = on; }
  void setLine(Line line) { line_ = line; }
  bool smoke() const { return smoke_; }
  Line line() const { return line_; }
  bool latched() const { return latched_; }

  // What the comparators show. An alarm stays until the supply has been off. Without supply no current flows.
  unsigned comparators(bool supply) {
    if (!supply) latched_ = false;
    else if (line_ == Line::whole && smoke_) latched_ = true;
    if (!supply || line_ == Line::open) return esc::kNoCurrent;
    if (line_ == Line::shorted) return esc::kShortCircuit;
    return latched_ ? esc::kAlarmCurrent : esc::kWholeLine;
  }

 private:
  Line line_ = Line::whole;
  bool smoke_ = false, latched_ = false;
};
