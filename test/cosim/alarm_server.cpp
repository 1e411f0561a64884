#include "alarm_server.h"

namespace {
constexpr size_t kIp = 14, kUdp = 34, kPayload = 42, kReportHeader = 24, kEventBytes = 16;
}

uint32_t big(const Bytes& b, size_t at, int bytes) {
  uint32_t v = 0;
  for (int i = 0; i < bytes; ++i) v = v << 8 | b[at + static_cast<size_t>(i)];
  return v;
}

void putBig(Bytes& b, uint32_t v, int bytes) {
  while (bytes-- > 0) b.push_back(static_cast<uint8_t>(v >> (8 * bytes)));
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
  const auto part = [this](size_t from, size_t to) { return Bytes(report_.begin() + static_cast<long>(from), report_.begin() + static_cast<long>(to)); };
  const auto length = static_cast<uint32_t>(data.size());
  Bytes f;
  for (const Bytes& mac : {part(6, 12), part(0, 6)}) f.insert(f.end(), mac.begin(), mac.end());
  putBig(f, 0x0800, 2);
  putBig(f, 0x4500, 2), putBig(f, 20 + 8 + length, 2), putBig(f, 0, 4), putBig(f, 0x4011, 2), putBig(f, 0, 2);
  for (const Bytes& ip : {part(30, 34), part(26, 30)}) f.insert(f.end(), ip.begin(), ip.end());
  putBig(f, big(report_, kUdp + 2, 2), 2), putBig(f, big(report_, kUdp, 2), 2), putBig(f, 8 + length, 2), putBig(f, 0, 2);
  f.insert(f.end(), data.begin(), data.end());
  putIpChecksum(f);
  return f;
}

void ReportServer::take(const NibbleFrame& f, const Bytes& b) {
  if (b.size() < kPayload + kReportHeader || big(b, 12, 2) != 0x0800 || b[23] != 17) return;
  if (big(b, kPayload, 2) != 0x4641 || b[kPayload + 3] != 1) return;
  report_ = b;
  boot_ = big(b, kPayload + 6, 2);
  const uint32_t first = big(b, kPayload + 8, 4), count = b[kPayload + 12];
  for (uint32_t i = next_ > first ? next_ - first : 0; i < count; ++i) {
    const size_t at = kPayload + kReportHeader + i * kEventBytes;
    const ReportedEvent e{b[at], b[at + 1], big(b, at + 2, 2), big(b, at + 4, 2), b[at + 6]};
    next_ = first + i + 1;
    if (onEvent) onEvent(f, e);
  }
  if (count == 0) return;
  Bytes acknowledgement;
  putBig(acknowledgement, 0x46410102, 4), putBig(acknowledgement, big(b, kPayload + 4, 4), 4), putBig(acknowledgement, next_, 4);
  network_.toMaster(frame(acknowledgement));
}
