#include "ring/can_host.h"

#include <algorithm>

#include "core/slave.h"
#include "ring-node-tp.h"

extern "C" {
#include "driver/registers.h"
#include "start_number.h"
}

namespace {
constexpr uint32_t kPassUs = 1000;
constexpr Time kStampsAnew = 65'536 * kUs;
// In relay mode frames from both sides overlap, and the longer one comes out behind one that began later.
constexpr Time kOverlap = 1000 * kUs;
constexpr uint32_t kLifeMask = 0x7f;
constexpr int kHead = 5, kDataAt = 8;
constexpr uint32_t kWaking = NODE_CAN_F_MASK_RECEIVED_MASK | NODE_CAN_F_MASK_SLOT_DONE_MASK |
                             NODE_CAN_F_MASK_STATE_MASK | NODE_CAN_F_MASK_BUS_ERROR_MASK;
}  // namespace

// As a node starts, but that every frame is received.
bool CanHost::start() {
  const ring_node_parameters& p = parameters_;
  uint32_t life;
  start_number(&board_, kLifeMask, 0, &life);
  can_port_config config{};
  config.address = p.address, config.home = p.home, config.relay = p.relay;
  config.kbps = p.kbps, config.core_mhz = p.core_mhz, config.confirm_us = p.confirm_us;
  config.life = static_cast<uint8_t>(life);
  config.up_ms = p.up_ms;
  config.pair_kbps = p.pair_kbps;
  if (!can_port_start(&port_, &board_, &config)) return false;
  uint8_t all[8] = {}, none[8] = {};
  number_to(all, 4, NODE_CAN_F_FILTERN_IN_USE_MASK);
  board_write(&board_, at(NODE_CAN_F_FILTERN(0)), all, sizeof all);
  board_write(&board_, at(NODE_CAN_F_FILTERN(1)), none, sizeof none);
  write_number(&board_, NODE_NODE_EVENTS, 2, 0xffff);
  write_number(&board_, NODE_NODE_MASK, 2, isOnPair_ ? kWaking << 8 : kWaking);
  // What was on the wire is lost; those behind it are not.
  if (busy_)
    ++failed_, pass_.push_back({CanEvent::failed, slave().nextRise(), onWire_.frame, {}, onWire_.by});
  busy_ = false;
  overrunsSeen_ = static_cast<uint8_t>(read_number(&board_, at(NODE_CAN_F_OVERRUNS), 1));
  return true;
}

// A stamp is the lower half of the controller's time in us, not long ago.
Time CanHost::timeOf(uint16_t stamp) {
  const auto now = static_cast<uint16_t>(read_number(&board_, NODE_NODE_TIME, 2));
  return slave().nextRise() - static_cast<uint16_t>(now - stamp) * kUs;
}

// Of a slow host only the newest frame began not long ago; each other one not long before the next one.
void CanHost::receive() {
  const size_t first = pass_.size();
  while (read_number(&board_, at(NODE_CAN_F_RX_LEVEL), 1) != 0) {
    uint8_t bytes[16];
    board_read(&board_, at(NODE_CAN_F_RX_FRAME), bytes, sizeof bytes);
    write_number(&board_, at(NODE_CAN_F_RX_RELEASE), 1, 1);
    const uint32_t word = number_at(bytes, 4);
    CanFrame f;
    f.extended = word & NODE_CAN_F_RX_EXTENDED_MASK;
    f.remote = word & NODE_CAN_F_RX_REMOTE_MASK;
    f.id = word & NODE_CAN_F_RX_IDENTIFIER_MASK;
    f.dlc = bytes[4] & 0x0f;
    std::copy(bytes + kDataAt, bytes + kDataAt + f.bytes(), f.data.begin());
    pass_.push_back(
        {CanEvent::received, timeOf(static_cast<uint16_t>(number_at(bytes + 6, 2))), f, {}, nullptr});
  }
  for (size_t i = pass_.size(); i-- > first + 1;)
    while (pass_[i - 1].at > pass_[i].at + kOverlap) pass_[i - 1].at -= kStampsAnew;
}

// One slot only, so that no frame overtakes another one.
void CanHost::sendNext() {
  const uint16_t slot = at(NODE_CAN_F_SLOTN(0));
  if (busy_) {
    if (read_number(&board_, at(NODE_CAN_F_REQUEST), 1) & 1) return;
    busy_ = false;
    const bool sent = read_number(&board_, at(NODE_CAN_F_SENT), 1) & 1;
    const Time at =
        sent ? timeOf(static_cast<uint16_t>(read_number(&board_, static_cast<uint16_t>(slot + 6), 2)))
             : slave().nextRise();
    if (!sent) ++failed_;
    pass_.push_back({sent ? CanEvent::sent : CanEvent::failed, at, onWire_.frame, {}, onWire_.by});
  }
  if (waiting_.empty()) return;
  onWire_ = waiting_.front();
  waiting_.pop_front();
  const CanFrame& f = onWire_.frame;
  uint8_t head[kHead];
  number_to(head, 4,
            f.id | (f.extended ? NODE_CAN_F_SLOTN_EXTENDED_MASK : 0) |
                (f.remote ? NODE_CAN_F_SLOTN_REMOTE_MASK : 0));
  head[4] = f.dlc;
  board_write(&board_, slot, head, sizeof head);
  board_write(&board_, static_cast<uint16_t>(slot + kDataAt), f.data.data(),
              static_cast<uint16_t>(f.data.size()));
  write_number(&board_, at(NODE_CAN_F_REQUEST), 1, 1);
  busy_ = true;
}

// A change of the state comes with a bus error, and is told behind it.
void CanHost::lookAtFaults(bool isError) {
  CanFault now;
  const uint32_t status = read_number(&board_, at(NODE_CAN_F_STATUS), 1);
  const uint32_t both = read_number(&board_, at(NODE_CAN_F_ERROR_COUNTERS), 4);
  now.state = status & NODE_CAN_F_STATE_MASK;
  now.tec = both & NODE_CAN_F_TEC_MASK;
  now.rec = (both & NODE_CAN_F_REC_MASK) >> NODE_CAN_F_REC_SHIFT;
  if (isError) {
    const uint32_t last = read_number(&board_, at(NODE_CAN_F_LAST_ERROR), 4);
    CanFault error = now;
    error.type = last & NODE_CAN_F_ERROR_TYPE_MASK;
    error.sender = last & NODE_CAN_F_ERROR_SENDER_MASK;
    error.field = (last & NODE_CAN_F_ERROR_FIELD_MASK) >> NODE_CAN_F_ERROR_FIELD_SHIFT;
    error.bit = (last & NODE_CAN_F_ERROR_BIT_MASK) >> NODE_CAN_F_ERROR_BIT_SHIFT;
    pass_.push_back({CanEvent::fault, slave().nextRise(), {}, error, nullptr});
  }
  if (now.state != last_.state) pass_.push_back({CanEvent::fault, slave().nextRise(), {}, now, nullptr});
  last_ = now;
}

// The register stops at 255 (CAN-46), so it is cleared before. The FIFO has just been emptied: until it is
// full again nothing is dropped, and so nothing between the read and the clear. What the same command clears
// beside it are numbers that nobody reads, and the last error: of a port with bus errors it would be lost.
void CanHost::countOverruns() {
  const auto overruns = static_cast<uint8_t>(read_number(&board_, at(NODE_CAN_F_OVERRUNS), 1));
  overruns_ += static_cast<uint8_t>(overruns - overrunsSeen_);
  overrunsSeen_ = overruns;
  if (overruns == 0 || hasBusErrors()) return;
  write_number(&board_, at(NODE_CAN_F_COMMAND), 1, NODE_CAN_F_CLEAR_COUNTERS_MASK);
  overrunsSeen_ = 0;
}

// Frames that came and frames that left are looked at one after the other. Others may take what was published
// before during any access to the controller.
void CanHost::publish() {
  std::stable_sort(pass_.begin(), pass_.end(),
                   [](const CanEvent& a, const CanEvent& b) { return a.at < b.at; });
  events_.insert(events_.end(), pass_.begin(), pass_.end());
  pass_.clear();
}

void CanHost::run() {
  boot();
  for (bool good = start();;) {
    board_wait(&board_, kPassUs);
    board_watchdog(&board_);
    if (!good || !can_port_runs(&port_)) good = start();
    if (!good) continue;
    const uint32_t events = read_number(&board_, NODE_NODE_EVENTS, 2);
    write_number(&board_, NODE_NODE_EVENTS, 2, events);
    ringState_ = static_cast<uint8_t>(read_number(&board_, NODE_RING_STATE, 1));
    ringPorts_ = static_cast<uint8_t>(read_number(&board_, NODE_RING_PORTS, 1));
    receive();
    countOverruns();
    sendNext();
    const uint32_t errors = NODE_CAN_F_EVENT_BUS_ERROR_MASK << (isOnPair_ ? 8 : 0);
    if (hasBusErrors()) lookAtFaults((events & errors) != 0);
    publish();
  }
}
