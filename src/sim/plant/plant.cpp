#include "plant/plant.h"

#include <arpa/inet.h>
#include <slirp/libslirp.h>

#include <chrono>
#include <stdexcept>
#include <utility>

namespace {
// Its timers go by real time, as those of the server do.
int64_t nowNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

struct Meaning {
  int slirp;
  short poll;
};
constexpr Meaning kMeanings[] = {{SLIRP_POLL_IN, POLLIN},
                                 {SLIRP_POLL_OUT, POLLOUT},
                                 {SLIRP_POLL_PRI, POLLPRI},
                                 {SLIRP_POLL_ERR, POLLERR},
                                 {SLIRP_POLL_HUP, POLLHUP}};
}  // namespace

struct Plant::Callbacks {
  static Plant& plant(void* p) { return *static_cast<Plant*>(p); }
  static ssize_t send(const void* data, size_t size, void* p) {
    const auto* bytes = static_cast<const uint8_t*>(data);
    plant(p).waiting_.emplace_back(bytes, bytes + size);
    return static_cast<ssize_t>(size);
  }
  static void complain(const char*, void*) {}  // of what the master sends: tests look at that
  static int64_t clock(void*) { return nowNs(); }
  static void* newTimer(SlirpTimerCb callback, void* opaque, void* p) {
    plant(p).timers_.push_back({callback, opaque});
    return &plant(p).timers_.back();
  }
  static void freeTimer(void* timer, void* p) {
    plant(p).timers_.remove_if([&](const Timer& t) { return &t == timer; });
  }
  static void setTimer(void* timer, int64_t ms, void*) { static_cast<Timer*>(timer)->atMs = ms; }
  static void nothing(int, void*) {}
  static void notify(void*) {}
  static int wanted(int fd, int events, void* p) {
    short poll = 0;
    for (auto& m : kMeanings)
      if (events & m.slirp) poll |= m.poll;
    plant(p).fds_.push_back({fd, poll, 0});
    return static_cast<int>(plant(p).fds_.size()) - 1;
  }
  static int happened(int index, void* p) {
    int events = 0;
    for (auto& m : kMeanings)
      if (plant(p).fds_[static_cast<size_t>(index)].revents & m.poll) events |= m.slirp;
    return events;
  }
};

Plant::Plant(std::function<void(const Bytes&)> toNode) : toNode_(std::move(toNode)) {
  static const SlirpCb callbacks = [] {
    SlirpCb c{};
    c.send_packet = Callbacks::send, c.guest_error = Callbacks::complain, c.clock_get_ns = Callbacks::clock;
    c.timer_new = Callbacks::newTimer, c.timer_free = Callbacks::freeTimer, c.timer_mod = Callbacks::setTimer;
    c.register_poll_fd = Callbacks::nothing, c.unregister_poll_fd = Callbacks::nothing,
    c.notify = Callbacks::notify;
    return c;
  }();
  SlirpConfig config{};
  config.version = 1;
  config.in_enabled = true;
  inet_pton(AF_INET, "10.0.2.0", &config.vnetwork);
  inet_pton(AF_INET, "255.255.255.0", &config.vnetmask);
  inet_pton(AF_INET, "10.0.2.2", &config.vhost);
  inet_pton(AF_INET, "10.0.2.3", &config.vnameserver);
  inet_pton(AF_INET, "10.0.2.100", &config.vdhcp_start);
  slirp_ = slirp_new(&config, &callbacks, this);
  if (!slirp_) throw std::runtime_error("libslirp cannot make the plant network.");
}

Plant::~Plant() { slirp_cleanup(slirp_); }

void Plant::fromNode(const Bytes& frame) {
  slirp_input(slirp_, frame.data(), static_cast<int>(frame.size()));
  deliver();
}

// Not inside libslirp, through which no exception may pass.
void Plant::deliver() {
  for (const Bytes& frame : std::exchange(waiting_, {})) toNode_(frame);
}

void Plant::poll() {
  for (auto it = timers_.begin(); it != timers_.end();) {
    Timer& timer = *it++;
    if (timer.atMs < 0 || timer.atMs > nowNs() / 1'000'000) continue;
    timer.atMs = -1;
    timer.callback(timer.opaque);
  }
  fds_.clear();
  uint32_t timeout = 0;
  slirp_pollfds_fill(slirp_, &timeout, Callbacks::wanted, this);
  const int result = ::poll(fds_.data(), fds_.size(), 0);
  slirp_pollfds_poll(slirp_, result < 0, Callbacks::happened, this);
  deliver();
}
