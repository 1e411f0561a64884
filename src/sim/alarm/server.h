// The server as far as measurements need it, without a socket: checks the master's reports, takes their
// events, and answers each at once.
#pragma once

#include <random>

#include "alarm/network.h"

// An event of a report (REP-01).
struct ReportedEvent {
  unsigned kind, position, node, sequence, state;
};

// What a report says of the line.
struct ReportedLine {
  uint32_t status = 0;                                // bits of enum protocol_master
  unsigned present = 0;                               // slaves that answer
  std::vector<std::pair<unsigned, unsigned>> slaves;  // status and node ID, by position
};

class ReportServer {
 public:
  ReportServer(AlarmNetwork& network, const AlarmOptions& options);
  // Takes each event once, with the frame of the report that told of it first.
  std::function<void(const NibbleFrame&, const ReportedEvent&)> onEvent;

  // The last report that counted; it did when the master had this server's life.
  const ReportedLine& line() const { return line_; }
  bool proven() const { return proven_; }
  // Datagrams that were no reports of this master.
  unsigned refused() const { return refused_; }

  // From now on every answer has this order, until the master tells its end; its ticket.
  uint32_t order(uint8_t order, uint16_t node, uint16_t seconds = 0);
  // The next answer, as it would be sent, with the order there is.
  Bytes answer() { return answer(next_); }
  // A datagram with this key's tag of all before its tag, as a server with this life makes it.
  static void tag(Bytes& answer, const uint8_t* key);
  // A frame with a UDP datagram (without checksum) from the server to the master; a report must have come.
  Bytes frame(const Bytes& data) const;
  // The last report, without the headers in front of it.
  Bytes report() const;

 private:
  Bytes answer(uint32_t number);  // of the next event wanted
  void take(const NibbleFrame& f, const Bytes& b);
  bool isRight(const Bytes& report) const;
  void takeEvents(const NibbleFrame& f, const Bytes& report, size_t at);

  AlarmNetwork& network_;
  const alarm_master_parameters& master_;
  Bytes life_;                                  // of this server
  Bytes report_;                                // the last right frame of the master
  Bytes masterLife_;                            // in it
  uint32_t counter_ = 0, turn_ = 0, next_ = 0;  // of reports, of answers, of events
  uint32_t ticket_ = 0;
  uint8_t order_ = 0;
  uint16_t node_ = 0, seconds_ = 0;
  ReportedLine line_;
  bool proven_ = false;
  unsigned refused_ = 0;
};

// The last report had so many slaves, all of them there with a host that lives.
bool isComplete(const ReportServer& server, size_t slaves);

// The `bytes` bytes at `at`, big endian; and the same appended.
uint32_t big(const Bytes& b, size_t at, int bytes);
void putBig(Bytes& b, uint64_t v, int bytes);
// Makes the checksum of the IP header of a frame anew.
void putIpChecksum(Bytes& frame);
