#include "ring/cannelloni_frame.h"

#include "ring/socketcan.h"

namespace {
constexpr size_t kHead = 5;
constexpr uint8_t kFd = 0x80;  // of a length: a byte of flags follows
}  // namespace

cannelloni::Found cannelloni::find(const uint8_t* d, size_t length) {
  Found found;
  if (length < kHead) return found;
  uint32_t id = 0;
  for (int i = 0; i < 4; ++i) id = id << 8 | d[i];
  const bool isFd = d[4] & kFd;
  const size_t bytes = isFd ? d[4] & ~kFd : d[4];
  const size_t carried = (isFd ? 1 : 0) + (id & socketcan::kRemote ? 0 : bytes);
  found.isMalformed = bytes > (isFd ? 64 : 8);
  if (found.isMalformed || length - kHead < carried) return found;
  if (!isFd) {
    found.frame = socketcan::canFrame(id, bytes, d + kHead);
    found.isMalformed = !found.frame;
  }
  found.bytes = kHead + carried;
  return found;
}

std::string cannelloni::bytesOf(const CanFrame& frame) {
  const socketcan::Frame f = socketcan::of(frame);
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(f.id >> shift);
  bytes += static_cast<char>(f.length);
  if (!frame.remote) bytes.append(f.data.begin(), f.data.begin() + f.length);
  return bytes;
}
