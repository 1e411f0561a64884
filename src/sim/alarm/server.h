// The server as far as measurements need it, without a socket: takes the master's reports and acknowledges
// them at once.
#pragma once

#include "alarm/network.h"

// An event of a report (REP-01).
struct ReportedEvent {
  unsigned kind, position, node, sequence, state;
};

class ReportServer {
 public:
  explicit ReportServer(AlarmNetwork& network);
  // Takes each event once, with the frame of the report that told of it first.
  std::function<void(const NibbleFrame&, const ReportedEvent&)> onEvent;
  // Boot number in the last report.
  unsigned boot() const { return boot_; }
  // A frame with a UDP datagram (without checksum) from the server to the master; a report must have come.
  Bytes frame(const Bytes& data) const;

 private:
  void take(const NibbleFrame& f, const Bytes& b);

  AlarmNetwork& network_;
  Bytes report_;  // the last one
  unsigned boot_ = 0;
  uint32_t next_ = 0;  // number of the next event
};

// The `bytes` bytes at `at`, big endian; and the same appended.
uint32_t big(const Bytes& b, size_t at, int bytes);
void putBig(Bytes& b, uint32_t v, int bytes);
// The first bytes of a datagram between master and server.
Bytes datagramOf(uint8_t kind);
// Makes the checksum of the IP header of a frame anew.
void putIpChecksum(Bytes& frame);
