// Recordings of a CAN port, times are simulated (TL-02).
#pragma once

#include <cstdio>
#include <string>

#include "core/pcap_io.h"
#include "ring/door.h"

// A capture with link type 227, frames and errors.
class PcapRecorder : public Door {
 public:
  explicit PcapRecorder(const std::string& path);
  void serve(CanHost*) override {}
  void happened(const CanEvent& event) override;
  std::string name() const override { return "pcap"; }

 private:
  CaptureWriter file_;
};

// What `candump -L` writes.
class CandumpRecorder : public Door {
 public:
  explicit CandumpRecorder(const std::string& path);
  ~CandumpRecorder() override;
  void serve(CanHost*) override {}
  void happened(const CanEvent& event) override;
  std::string name() const override { return "candump"; }

 private:
  std::string path_;
  std::FILE* file_;
};
