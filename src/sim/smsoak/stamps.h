// What must hold of the buffers of one SyncManager whose two sides keep to its rules, whatever the model
// says: every writer fills the whole buffer with the number of the message, so that each byte read tells
// which message it is from.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>

namespace smsoak {

class Stamps {
 public:
  // Starts anew behind a reset of the SyncManager.
  void reset(bool mailbox) {
    mailbox_ = mailbox, inSession_ = perhapsOpen_ = false;
    lastRead_ = ++begun_;
    completed_.fill({lastRead_, 0});
    inOrder_ = lastRead_;
  }

  // A new message, 1 to 255; never 0, which a denied read returns.
  uint8_t begin() { return stamp(++begun_); }
  // The newest message is complete since `time`.
  void complete(uint64_t time) {
    for (size_t i = completed_.size() - 1; i > 0; --i) completed_[i] = completed_[i - 1];
    completed_[0] = {begun_, time};
  }

  // The reader reads a byte at `offset`, with the access that begins in cycle `from`. Returns what is wrong.
  std::string read(unsigned offset, uint8_t value, uint64_t from) {
    if (offset == 0 && !inSession_) {
      inSession_ = true;
      return open(value, from);
    }
    if (value != stamp(now_))
      return "torn: byte " + std::to_string(offset) + " is of message " + std::to_string(messageOf(value)) +
             ", the first byte of " + std::to_string(now_);
    return "";
  }
  // It will begin with the first byte again, perhaps in the buffer it has open.
  void drop() { perhapsOpen_ |= inSession_, inSession_ = false; }
  // It has read the last byte, for good.
  std::string close() {
    inSession_ = false;
    if (mailbox_ && now_ != inOrder_ + 1)
      return "message " + std::to_string(now_) +
             (now_ <= inOrder_ ? " is doubled"
                               : " comes, message " + std::to_string(inOrder_ + 1) + " is lost");
    inOrder_ = now_;
    ++read_;
    return "";
  }
  uint64_t messagesRead() const { return read_; }

 private:
  struct Completed {
    uint64_t message, time;
  };
  static uint8_t stamp(uint64_t message) { return static_cast<uint8_t>(message % 255 + 1); }
  // The newest message with this stamp.
  uint64_t messageOf(uint8_t value) const {
    for (uint64_t m = begun_; m + 255 > begun_ && m > 0; --m)
      if (stamp(m) == value) return m;
    return 0;
  }
  std::string open(uint8_t value, uint64_t from) {
    if (std::exchange(perhapsOpen_, false) && value == stamp(now_)) return "";
    now_ = messageOf(value);
    if (now_ < lastRead_)
      return "message " + std::to_string(now_) + " is older than " + std::to_string(lastRead_) +
             " read before";
    lastRead_ = now_;
    for (const Completed& c : completed_)
      if (c.time < from && now_ < c.message)
        return "message " + std::to_string(now_) + " is not the newest, " + std::to_string(c.message) +
               " was complete";
    return "";
  }

  bool mailbox_ = false, inSession_ = false, perhapsOpen_ = false;
  uint64_t begun_ = 1000, now_ = 0, lastRead_ = 0, inOrder_ = 0, read_ = 0;
  std::array<Completed, 4> completed_{};
};

}  // namespace smsoak
