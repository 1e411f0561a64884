#include "ring/master_link.h"

#include <poll.h>

#include <algorithm>

namespace {
constexpr Time kRoundTrip = 500 * kUs;           // of the longest frame through the gateway, and more
constexpr timespec kLongestWait{0, 20'000'000};  // so that control lines and signals are served
constexpr int64_t kMostAheadNs = 20'000;         // of simulated time

bool isShorter(const timespec& a, const timespec& b) {
  return a.tv_sec != b.tv_sec ? a.tv_sec < b.tv_sec : a.tv_nsec < b.tv_nsec;
}
}  // namespace

void MasterLink::serve() {
  EthernetCable& cable = *ring_.master();
  while (card_.receive(frame_)) cable.send(frame_, ring_.now());
  for (const auto& f : cable.taken()) card_.send(f.bytes);
  const bool isUnderWay = cable.toNode() != cable.fromNode() && ring_.now() - cable.lastSent() < kRoundTrip;
  if (scale_ > 0 && !isUnderWay) waitForWall();
}

void MasterLink::waitForWall() {
  const int64_t lag = pacer_.lag(ring_.now() / kNs);
  if (lag >= -kMostAheadNs) return;
  const timespec wait = std::min(*pacer_.sleep(lag, 0), kLongestWait, isShorter);
  pollfd card{card_.fd(), POLLIN, 0};
  ppoll(&card, 1, &wait, nullptr);
}
