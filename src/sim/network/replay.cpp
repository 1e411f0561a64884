#include "network/replay.h"

#include <algorithm>
#include <deque>
#include <limits>

#include "core/pcap_io.h"
#include "core/user_error.h"

namespace {
// While nothing is on any wire, time advances by so much at once.
constexpr int64_t kIdleSliceNs = 10'000;

// A frame that left the master; slaves set bit 1 of the first source address byte.
bool fromMaster(const RecordedFrame& f) { return f.bytes.size() >= 14 && (f.bytes[6] & 0x02) == 0; }
}  // namespace

ReplayResult replay(const NetworkSpec& spec, const NetworkOptions& networkOptions,
                    const ReplayOptions& options) {
  std::vector<RecordedFrame> frames = readCapture(options.in);
  frames.erase(std::remove_if(frames.begin(), frames.end(), [](auto& f) { return !fromMaster(f); }),
               frames.end());
  if (frames.empty()) throw UserError("the capture '" + options.in + "' holds no frame of a master.");
  CaptureWriter out(options.out);

  ReplayResult result;
  std::deque<int64_t> pending;  // when the frames on their way were sent (last nibble)
  const auto timeout = static_cast<int64_t>(options.timeoutUs * 1000);
  auto expire = [&](int64_t now) {
    for (; !pending.empty() && now - pending.front() > timeout; pending.pop_front()) ++result.lost;
  };
  Network network(spec, networkOptions, [&](int64_t ns, const NibbleFrame& f, size_t) {
    expire(ns);
    if (!pending.empty()) pending.pop_front();
    Payload p = payloadOf(f.nibbles);
    if (!p.sfd || p.bytes.size() < 64) {
      ++result.runts;
    } else if (crc32(p.bytes.data(), p.bytes.size()) != kCrcResidue) {
      ++result.badFcs;
    } else {
      p.bytes.resize(p.bytes.size() - 4);
      out.write(ns, p.bytes);
      ++result.returned;
    }
  });

  const int64_t begin = network.ns() + 10'000;
  auto next = frames.begin();
  auto plannedNs = [&] { return begin + (next->ns - frames.front().ns); };
  std::deque<std::pair<int64_t, const Bytes*>>
      unrecorded;  // sent frames whose end is still to come, for --both
  auto recordSent = [&](int64_t now) {
    for (; !unrecorded.empty() && unrecorded.front().first <= now; unrecorded.pop_front())
      if (options.both) out.write(unrecorded.front().first, *unrecorded.front().second);
  };
  while (true) {
    const int64_t now = network.ns();
    recordSent(now);
    if (next != frames.end() && now >= plannedNs() && network.sent()) {
      pending.push_back(network.send(next->bytes));
      unrecorded.push_back({pending.back(), &next->bytes});
      ++result.sent, ++next;
    } else if (next == frames.end() && (pending.empty() || (networkOptions.skipIdle && network.idle()))) {
      break;
    } else {
      expire(now);
    }
    const int64_t wake = next != frames.end() ? plannedNs() : now;
    const bool skips = networkOptions.skipIdle && network.idle();
    if (wake > now + 1000 && !skips && network.quiet()) network.idleUntil(std::min(wake, now + kIdleSliceNs));
    else network.step(wake);
  }
  result.lost += pending.size();
  recordSent(std::numeric_limits<int64_t>::max());
  result.simulatedNs = network.ns(), result.skippedNs = network.skippedNs(),
  result.coreCycles = network.coreCycles();
  return result;
}
