#include "ring/master_link.h"

#include <poll.h>

#include <algorithm>

namespace {
constexpr Time kRoundTrip = 500 * kUs;  // of the longest frame through the gateway, and more
constexpr double kLongestWaitMs = 20;   // so that control lines and signals are served
constexpr double kMostAheadMs = 0.02;   // of simulated time
constexpr double kMostBehindMs = 1;     // what the simulation lags by more is given up
}  // namespace

void MasterLink::serve() {
  EthernetCable& cable = *ring_.master();
  while (card_.receive(frame_)) cable.send(frame_, ring_.now());
  for (const auto& f : cable.taken()) card_.send(f.bytes);
  const bool isUnderWay = cable.toNode() != cable.fromNode() && ring_.now() - cable.lastSent() < kRoundTrip;
  if (scale_ > 0 && !isUnderWay) waitForWall();
}

void MasterLink::waitForWall() {
  const double wallMs = std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
  const double simulatedMs = static_cast<double>((ring_.now() - startOfRing_) / kNs) / 1e6;
  const double aheadMs = simulatedMs - wallMs * scale_;
  if (aheadMs < -kMostBehindMs) {
    start_ = Clock::now();
    startOfRing_ = ring_.now();
  }
  if (aheadMs <= kMostAheadMs) return;
  pollfd card{card_.fd(), POLLIN, 0};
  poll(&card, 1, static_cast<int>(std::clamp(aheadMs / scale_, 1.0, kLongestWaitMs)));
}
