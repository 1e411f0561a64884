// The master: frames of datagrams to areas and registers of SyncManagers, some of them broken on their way.
#pragma once

#include <array>

#include "smsoak/frame.h"
#include "smsoak/slots.h"

namespace smsoak {

class Master {
 public:
  Master(Slots& slots, Random& random) : slots_(slots), random_(random) {}

  // What a slave must be told first.
  Frame setUp();
  // The next frame.
  Frame next();
  // It has come back; it began, has had all its effects in these cycles. The SyncManagers that are new now: a
  // bit each.
  unsigned takeBack(Frame& frame, uint64_t began, uint64_t ended);
  const std::string& violation() const { return violation_; }

 private:
  // A piece of an orderly buffer in this frame.
  struct Piece {
    size_t datagram;
    unsigned slot, offset;
  };
  struct Session {
    unsigned position = 0;  // bytes done
    uint8_t stamp = 0;      // of the message it writes; 0: a new one
    bool closed = false;    // in this frame
    bool failed = false;    // in this frame
  };
  void moveAll();
  void addChanges();
  void addRandom();
  void addOrderly(unsigned n);
  void addWild(unsigned n);
  void addShifted();
  void addRegister(unsigned n);
  void addConfiguration(unsigned n);
  void add(bool read, bool write, unsigned address, Bytes data);
  Bytes random(unsigned length);
  bool wild(unsigned first, unsigned last) const;
  void piece(const Frame& frame, const Piece& p, const Datagram& d, uint64_t began, uint64_t ended);

  Slots& slots_;
  Random& random_;
  std::vector<Datagram> datagrams_;
  std::vector<Piece> pieces_;
  std::array<Session, kSms> sessions_;
  unsigned off_ = 0, on_ = 0;  // SyncManagers this frame switches off, on
  unsigned frames_ = 0;
  int shift_ = 0;  // logical window 1 writes so far behind where it reads
  unsigned reader_ = 0, writer_ = 0;
  std::string violation_;
};

}  // namespace smsoak
