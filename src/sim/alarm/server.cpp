#include "alarm/server.h"

#include "core/esc.h"
#include "protocol.h"

namespace {

// Where the headers of a UDP datagram in an Ethernet frame begin, and what it carries.
constexpr size_t kIp = 14, kUdp = 34, kPayload = 42;
constexpr size_t kIpProtocol = kIp + 9;
}  // namespace

uint32_t big(const Bytes& b, size_t at, int bytes) {
  uint32_t v = 0;
  for (int i = 0; i < bytes; ++i) v = v << 8 | b[at + static_cast<size_t>(i)];
  return v;
}

void putBig(Bytes& b, uint32_t v, int bytes) {
  while (bytes-- > 0) b.push_back(static_cast<uint8_t>(v >> (8 * bytes)));
}

Bytes datagramOf(uint8_t kind) {
  Bytes d;
  putBig(d, PROTOCOL_MAGIC, 2), putBig(d, PROTOCOL_VERSION, 1), putBig(d, kind, 1);
  return d;
}

void putIpChecksum(Bytes& frame) {
  uint32_t sum = 0;
  frame[24] = frame[25] = 0;
  for (size_t i = kIp; i < kUdp; i += 2) sum += big(frame, i, 2);
  sum = (sum & 0xffff) + (sum >> 16);
  sum = ~((sum & 0xffff) + (sum >> 16));
  frame[24] = static_cast<uint8_t>(sum >> 8), frame[25] = static_cast<uint8_t>(sum);
}

ReportServer::ReportServer(AlarmNetwork& network) : network_(network) {
  network.onFromMaster = [this](const NibbleFrame& f, const Bytes& b) { take(f, b); };
}

// To where the last report came from.
Bytes ReportServer::frame(const Bytes& data) const {
  const auto part = [this](size_t from, size_t to) {
    return Bytes(report_.begin() + static_cast<long>(from), report_.begin() + static_cast<long>(to));
  };
  const auto length = static_cast<uint32_t>(data.size());
  Bytes f;
  for (const Bytes& mac : {part(6, 12), part(0, 6)}) f.insert(f.end(), mac.begin(), mac.end());
  putBig(f, esc::kIpv4, 2);
  putBig(f, 0x4500, 2), putBig(f, 20 + 8 + length, 2), putBig(f, 0, 4), putBig(f, 0x4000 | esc::kUdp, 2),
      putBig(f, 0, 2);
  for (const Bytes& ip : {part(30, 34), part(26, 30)}) f.insert(f.end(), ip.begin(), ip.end());
  putBig(f, big(report_, kUdp + 2, 2), 2), putBig(f, big(report_, kUdp, 2), 2), putBig(f, 8 + length, 2),
      putBig(f, 0, 2);
  f.insert(f.end(), data.begin(), data.end());
  putIpChecksum(f);
  return f;
}

void ReportServer::take(const NibbleFrame& f, const Bytes& b) {
  if (b.size() < kPayload + PROTOCOL_REPORT_BYTES || big(b, 12, 2) != esc::kIpv4 ||
      b[kIpProtocol] != esc::kUdp)
    return;
  if (big(b, kPayload, 2) != PROTOCOL_MAGIC || b[kPayload + PROTOCOL_REPORT_KIND_AT] != PROTOCOL_KIND_REPORT)
    return;
  report_ = b;
  boot_ = big(b, kPayload + PROTOCOL_REPORT_BOOT_AT, 2);
  const uint32_t first = big(b, kPayload + PROTOCOL_REPORT_NUMBER_AT, 4),
                 count = b[kPayload + PROTOCOL_REPORT_COUNT_AT];
  for (uint32_t i = next_ > first ? next_ - first : 0; i < count; ++i) {
    const size_t at = kPayload + PROTOCOL_REPORT_BYTES + i * PROTOCOL_EVENT_BYTES;
    const ReportedEvent e{b[at + PROTOCOL_EVENT_KIND_AT], b[at + PROTOCOL_EVENT_POSITION_AT],
                          big(b, at + PROTOCOL_EVENT_NODE_AT, 2), big(b, at + PROTOCOL_EVENT_SEQUENCE_AT, 2),
                          b[at + PROTOCOL_EVENT_STATE_AT]};
    next_ = first + i + 1;
    if (onEvent) onEvent(f, e);
  }
  if (count == 0) return;
  Bytes acknowledgement = datagramOf(PROTOCOL_KIND_ACKNOWLEDGE);
  putBig(acknowledgement, big(b, kPayload + PROTOCOL_REPORT_MASTER_AT, 4), 4);  // master and boot
  putBig(acknowledgement, next_, 4);
  network_.toMaster(frame(acknowledgement));
}
