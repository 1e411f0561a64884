// A ring node's controller as its host program sees it, whose frames leave at once. It includes no header of
// registers: ring-node-tp.h, or that of another preset, stands in front of it.
#pragma once

#include <algorithm>
#include <cstring>
#include <deque>

#include "fake.h"

extern "C" {
#include "ring/frame.h"
}

using Bytes = std::vector<uint8_t>;

struct RingBoard : board {
  uint32_t now = 1000;  // the host's clock, us
  bool gone = false;    // nothing drives the host bus: it reads as `floating`
  uint8_t floating = 0xff;
  bool alone = false;   // nobody acknowledges: frames wait until they are aborted
  unsigned waiting = 0;
  std::deque<Bytes> fifo;
  std::vector<ring_frame> frames;
  unsigned clears = 0;  // of conflicts of addresses
  uint32_t longest = 0;  // wait, in us

  RingBoard() {
    memory[NODE_NODE_TYPE] = 0xf3;
    memory[NODE_RING_PORTS] = NODE_RING_UP1_MASK | NODE_RING_UP2_MASK;
  }
  static bool isIn(uint16_t a, uint16_t first, unsigned bytes) { return a >= first && a < first + bytes; }
  uint32_t time() override { return now; }
  void wait(uint32_t us) override { longest = std::max(longest, us); }
  uint8_t readByte(uint16_t a) override {
    if (gone) return floating;
    if (isIn(a, NODE_NODE_TIME, 4)) return static_cast<uint8_t>(now >> 8 * (a - NODE_NODE_TIME));
    if (a == NODE_CAN_F_RX_LEVEL) return static_cast<uint8_t>(std::min<size_t>(fifo.size(), 64));
    if (isIn(a, NODE_CAN_F_RX_FRAME, 16)) return fifo.empty() ? 0 : fifo.front()[a - NODE_CAN_F_RX_FRAME];
    if (isIn(a, NODE_CAN_F_REQUEST, 2)) return static_cast<uint8_t>(waiting >> 8 * (a - NODE_CAN_F_REQUEST));
    return board::readByte(a);
  }
  void writeByte(uint16_t a, uint8_t value) override {
    if (gone) return;
    board::writeByte(a, value);
    if (a == NODE_CAN_F_RX_RELEASE && !fifo.empty()) fifo.pop_front();
    const unsigned bits = value;
    if (isIn(a, NODE_CAN_F_REQUEST, 2)) waiting |= bits << 8 * (a - NODE_CAN_F_REQUEST);
    if (isIn(a, NODE_CAN_F_ABORT, 2)) waiting &= ~(bits << 8 * (a - NODE_CAN_F_ABORT));
    if (a == NODE_CAN_F_COMMAND && value & NODE_CAN_F_ABORT_ALL_MASK) waiting = 0;
    if (a == NODE_RING_CONTROL && (value & NODE_RING_CLEAR_MASK)) {
      memory[a] = static_cast<uint8_t>(value & ~NODE_RING_CLEAR_MASK);
      memory[NODE_RING_STATE] = static_cast<uint8_t>(memory[NODE_RING_STATE] & ~NODE_RING_CONFLICT_MASK);
      ++clears;
    }
    if (!alone) leaveAll();
  }
  void leaveAll() {
    for (unsigned i = 0; i < 16; ++i)
      if (waiting >> i & 1) leave(i);
    waiting = 0;
  }
  // Another node has the same address (FR-62).
  void conflicts() { memory[NODE_RING_STATE] |= NODE_RING_CONFLICT_MASK; }
  void leave(unsigned slot) {
    const uint8_t* bytes = &memory[NODE_CAN_F_SLOTN(slot)];
    ring_frame f{};
    f.id = static_cast<uint32_t>(bytes[0] | bytes[1] << 8 | bytes[2] << 16 | (bytes[3] & 0x1f) << 24);
    f.dlc = bytes[4];
    std::memcpy(f.data, bytes + 8, sizeof f.data);
    frames.push_back(f);
  }
  void comes(const ring_id& id, const Bytes& data) {
    Bytes frame(16);
    const uint32_t word = ring_id_word(&id) | 1u << 31;
    for (int i = 0; i < 4; ++i) frame[static_cast<size_t>(i)] = static_cast<uint8_t>(word >> 8 * i);
    frame[4] = static_cast<uint8_t>(data.size());
    std::copy(data.begin(), data.end(), frame.begin() + 8);
    fifo.push_back(frame);
  }
};
