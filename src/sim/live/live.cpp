#include "live/live.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <deque>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/control.h"
#include "live/pacer.h"
#include "live/packet_socket.h"
#include "core/user_error.h"

namespace {
using Clock = std::chrono::steady_clock;

constexpr int64_t kSliceNs = 1000;     // idle time simulated between two looks at the interface
constexpr int64_t kSleepNs = 100'000;  // an up-to-date simulation sleeps until it lags by this
constexpr int kEventsPerLook = 200;    // with a frame on its way

volatile std::sig_atomic_t stopRequested = 0;

// SIGINT and SIGTERM arrive only where the loop waits, so that none falls between a look and a sleep.
class Signals {
 public:
  Signals() {
    struct sigaction action {};
    action.sa_handler = [](int) { stopRequested = 1; };
    sigset_t ours;
    sigemptyset(&ours);
    for (int s : {SIGINT, SIGTERM}) sigaction(s, &action, nullptr), sigaddset(&ours, s);
    sigprocmask(SIG_BLOCK, &ours, &waiting_);
    for (int s : {SIGINT, SIGTERM}) sigdelset(&waiting_, s);
  }
  const sigset_t* waiting() const { return &waiting_; }
  // One has come that the loop has not taken yet.
  static bool pending() {
    sigset_t set;
    sigpending(&set);
    return sigismember(&set, SIGINT) || sigismember(&set, SIGTERM);
  }

 private:
  sigset_t waiting_;
};

class Live {
 public:
  Live(const NetworkSpec& spec, const NetworkOptions& networkOptions, const LiveOptions& options)
      : network_(spec, networkOptions,
                 [this](int64_t, const NibbleFrame& f, size_t card) { returned(f, card); }),
        pacer_(options.timeScale, network_.ns()),
        staleSeconds_(options.staleMs * 1e-3) {
    if (spec.ring && options.ringInterface.empty())
      throw UserError("the network is a ring: --ring-interface is needed for its other end.");
    if (!spec.ring && !options.ringInterface.empty())
      throw UserError("--ring-interface is given, but the network is no ring.");
    nics_.push_back(std::make_unique<PacketSocket>(options.interface));
    if (spec.ring) nics_.push_back(std::make_unique<PacketSocket>(options.ringInterface));
    waiting_.resize(nics_.size());
    if (!options.sync.empty()) writeSync(options.sync);
    if (!options.control.empty())
      control_.emplace(options.control, [this](auto& words) { return command(words); });
    std::printf("joined %s: %zu slaves\n", options.interface.c_str(), network_.size());
    std::fflush(stdout);
  }

  LiveResult run() {
    const int64_t beginNs = network_.ns();
    const uint64_t beginCycles = network_.coreCycles();
    timespec none{};
    while (!stopRequested && !quit_) {
      look(&none);
      const Clock::time_point begin = Clock::now();
      if (!network_.quiet()) {
        for (int i = 0; i < kEventsPerLook; ++i) network_.step(network_.ns());
      } else {
        result_.lost += inFlight_.size();
        inFlight_.clear();
        const int64_t lag = pacer_.lag(network_.ns());
        if (lag >= kSliceNs) {
          network_.idleUntil(network_.ns() + kSliceNs);
        } else {
          const std::optional<timespec> sleep = pacer_.sleep(lag, kSleepNs);
          look(sleep ? &*sleep : nullptr);
          continue;
        }
      }
      result_.busySeconds += secondsSince(begin);
    }
    result_.simulatedNs = network_.ns() - beginNs;
    result_.coreCycles = network_.coreCycles() - beginCycles;
    if (result_.returned > 0) result_.meanRoundUs /= static_cast<double>(result_.returned);
    return result_;
  }

 private:
  // Waits for frames, control lines or a signal, and takes what has come.
  void look(const timespec* timeout) {
    fds_.clear();
    for (auto& nic : nics_) fds_.push_back({nic->fd(), POLLIN, 0});
    if (control_) control_->wanted(fds_);
    if (ppoll(fds_.data(), fds_.size(), timeout, signals_.waiting()) > 0) {
      for (size_t i = 0; i < nics_.size(); ++i)
        while (fds_[i].revents && nics_[i]->receive(frame_)) {
          waiting_[i].push_back({Clock::now(), frame_});
          ++result_.received;
        }
      const auto lines = fds_.begin() + static_cast<std::ptrdiff_t>(nics_.size());
      if (control_ && std::any_of(lines, fds_.end(), [](auto& f) { return f.revents != 0; }))
        control_->serve();
    }
    for (size_t i = 0; i < nics_.size(); ++i) send(i);
  }

  // A card takes the next frame when it has sent the one before. What has waited for too long is answered by
  // nobody: its master has given it up, and a late answer would hold up those behind it.
  void send(size_t card) {
    for (auto& queue = waiting_[card]; !queue.empty() && network_.sent(card); queue.pop_front()) {
      if (staleSeconds_ > 0 && secondsSince(queue.front().came) > staleSeconds_) {
        ++result_.stale;
        continue;
      }
      network_.send(queue.front().frame, card);
      last_ = queue.front().frame;
      inFlight_.push_back(queue.front().came);
    }
  }

  void writeSync(const std::string& path) {
    sync_.open(path, std::ios::trunc);
    if (!sync_) throw UserError("cannot write '" + path + "'.");
    for (size_t i = 0; i < network_.size(); ++i)
      network_.slave(i).onSync = [this, i](int signal, bool level, Time at) {
        sync_ << i << ' ' << signal << ' ' << level << ' ' << nsText(at) << '\n';
      };
  }

  static std::string nsText(Time at) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2f", static_cast<double>(at) / kNs);
    return text;
  }

  static std::string hexText(uint32_t levels) {
    char text[16];
    std::snprintf(text, sizeof text, "0x%08x", levels);
    return text;
  }

  // The master's last frame again and again, faster than it could send it; no master sees what comes back.
  void repeat(size_t count, int64_t periodNs) {
    if (last_.empty()) throw UserError("the master has sent no frame yet.");
    while (!network_.quiet()) network_.step(network_.ns());
    repeats_ = true;
    for (int64_t due = network_.ns(); count > 0 && !signals_.pending(); --count, due += periodNs) {
      if (due > network_.ns()) network_.idleUntil(due);
      network_.send(last_);
      while (!network_.quiet()) network_.step(network_.ns());
    }
    repeats_ = false;
    sync_.flush();
  }

  // How long frames were away at each slave, from port 0 to their coming back at port 1; 0 at the last. Of
  // those that were alone on their way.
  void noteLoops() {
    if (inFlight_.size() != 1 && !repeats_) return;
    loops_.resize(network_.size());
    for (size_t i = 0; i < network_.size(); ++i) {
      const Slave& slave = network_.slave(i);
      loops_[i] += static_cast<double>(std::max<Time>(slave.arrival(1) - slave.arrival(0), 0));
    }
    ++noted_;
  }

  std::string loops() const {
    std::string text;
    for (double sum : loops_) text += (text.empty() ? "" : " ") + nsText(static_cast<Time>(sum / noted_));
    return text;
  }

  void returned(const NibbleFrame& f, size_t card) {
    noteLoops();
    if (repeats_) return;
    if (!inFlight_.empty()) {
      const double us = secondsSince(inFlight_.front()) * 1e6;
      inFlight_.pop_front();
      result_.meanRoundUs += us;
      result_.worstRoundUs = std::max(result_.worstRoundUs, us);
    }
    Payload p = payloadOf(f.nibbles);
    if (!p.sfd || p.bytes.size() < 64) {
      ++result_.runts;
    } else if (crc32(p.bytes.data(), p.bytes.size()) != kCrcResidue) {
      ++result_.badFcs;
    } else {
      p.bytes.resize(p.bytes.size() - 4);
      nics_[card]->send(p.bytes);
      ++result_.returned;
    }
  }

  std::string command(const std::vector<std::string>& words) {
    const std::string verb = words.empty() ? "" : words[0];
    if ((verb == "cut" || verb == "mend") && words.size() == 2) {
      network_.link(number(words[1], network_.links() - 1)).setWhole(verb == "mend");
    } else if (verb == "noise" && words.size() == 3) {
      network_.link(number(words[1], network_.links() - 1)).setBitErrors(number(words[2], 999'999'999));
    } else if (verb == "host" && words.size() >= 2) {
      const size_t i = number(words[1], network_.size() - 1);
      Host* host = network_.slave(i).host();
      if (!host) throw UserError("slave " + words[1] + " has no host program.");
      return host->command({words.begin() + 2, words.end()});
    } else if (verb == "outputs" && words.size() == 2) {
      const auto levels = network_.slave(number(words[1], network_.size() - 1)).digitalOutputs();
      return levels ? hexText(*levels) : "none";
    } else if (verb == "advance" && words.size() == 2) {
      const int64_t end = network_.ns() + static_cast<int64_t>(number(words[1], 10'000'000)) * 1000;
      while (!network_.quiet()) network_.step(network_.ns());
      if (end > network_.ns()) network_.idleUntil(end);
    } else if (verb == "repeat" && words.size() == 3) {
      repeat(number(words[1], 99'999'999), static_cast<int64_t>(number(words[2], 10'000'000)) * 1000);
    } else if (verb == "loops" && words.size() == 1) {
      return loops();
    } else if (verb == "time" && words.size() == 1) {
      return std::to_string(network_.ns()) + " ns";
    } else if (verb == "quit" && words.size() == 1) {
      quit_ = true;
    } else {
      throw UserError(
          "known: cut CABLE, mend CABLE, noise CABLE BITS, host SLAVE ..., outputs SLAVE, advance "
          "MICROSECONDS, repeat COUNT MICROSECONDS, loops, time, quit.");
    }
    return "";
  }

  static size_t number(const std::string& text, size_t most) {
    if (text.empty() || text.size() > 9 || text.find_first_not_of("0123456789") != std::string::npos ||
        std::stoul(text) > most)
      throw UserError("'" + text + "' is no number from 0 to " + std::to_string(most) + ".");
    return std::stoul(text);
  }

  Signals signals_;
  struct Waiting {
    Clock::time_point came;
    Bytes frame;
  };
  std::vector<std::unique_ptr<PacketSocket>> nics_;  // of each card
  Network network_;
  Pacer pacer_;
  std::optional<Control> control_;
  double staleSeconds_;
  std::vector<pollfd> fds_;
  std::vector<std::deque<Waiting>> waiting_;  // at each card
  Bytes frame_, last_;                        // the one that comes, the last one sent
  std::deque<Clock::time_point> inFlight_;    // when the frames on their way came
  LiveResult result_;
  bool quit_ = false, repeats_ = false;
  std::vector<double> loops_;  // sums, in units of Time
  size_t noted_ = 0;
  std::ofstream sync_;
};
}  // namespace

LiveResult live(const NetworkSpec& spec, const NetworkOptions& networkOptions, const LiveOptions& options) {
  NetworkOptions network = networkOptions;
  network.skipIdle = false;
  return Live(spec, network, options).run();
}
