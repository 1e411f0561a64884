// Reading and writing recorded Ethernet traffic, by libpcap.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/ethernet.h"

struct RecordedFrame {
  int64_t ns;  // time stamp
  Bytes bytes;
};

// All frames of a pcap or pcapng file. UserError if it cannot be read or is not Ethernet.
std::vector<RecordedFrame> readCapture(const std::string& path);

// Writes a pcap file with time stamps in nanoseconds. UserError if it cannot be written.
class CaptureWriter {
 public:
  // `linkType`: of libpcap; none: Ethernet.
  explicit CaptureWriter(const std::string& path, int linkType = 1);
  ~CaptureWriter();
  void write(int64_t ns, const Bytes& frame);

 private:
  struct Handles;
  void flush();
  std::string path_;
  std::unique_ptr<Handles> handles_;
};
