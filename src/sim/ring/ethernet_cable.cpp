#include "ring/ethernet_cable.h"

namespace {
constexpr int kPort = 0;
constexpr Time kDelay = 500 * kNs;  // of 100 m
constexpr size_t kMostBacklog = 100'000;
}  // namespace

EthernetCable::EthernetCable(Slave& node)
    : node_(node),
      collector_([this](NibbleFrame& f) {
        const Bytes bytes = goodFrame(f);
        if (bytes.empty()) return;
        frames_.push_back({f.end, bytes});
        ++fromNode_;
      }),
      sender_(node.receiver(kPort), 0, 0) {
  node.connect(kPort, collector_);
  node.receiver(kPort).setDelay(kDelay);
  node.setLink(kPort, true);
}

void EthernetCable::setPower(bool on, Time now) {
  powered_ = on;
  node_.setLink(kPort, on);
  if (!on) return sender_.clear();
  // What the node has got of a frame ends.
  sender_.skipTo(now);
  sender_.pushIdle(kMinimumGap);
}

void EthernetCable::send(const Bytes& frame, Time now) {
  if (!powered_ || sender_.backlog() > kMostBacklog) return;
  if (sender_.backlog() == 0) sender_.skipTo(now);
  for (uint8_t n : toNibbles(frame)) sender_.push({true, false, n});
  sender_.pushIdle(kMinimumGap);
  ++toNode_;
  lastSent_ = now;
}
