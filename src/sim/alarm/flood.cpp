#include "alarm/flood.h"

#include <mbedtls/md.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <stdexcept>

#include "alarm/server.h"
#include "core/esc.h"
#include "protocol.h"

namespace {
using nlohmann::ordered_json;
using namespace esc;

constexpr size_t kBurst = 250;       // counters of the controller stop at 255
constexpr size_t kBacklog = 200;     // nibbles that may wait for the cable
constexpr uint32_t kCounter = 1000;  // of the first command

class Flood {
 public:
  Flood(AlarmNetwork& network, const AlarmOptions& options)
      : network_(network),
        line_(network.line()),
        server_(network),
        options_(options),
        random_(options.line.seed) {
    server_.onEvent = [this](const NibbleFrame& f, const ReportedEvent& e) { take(f, e); };
  }

  ordered_json run(size_t count) {
    const auto begin = std::chrono::steady_clock::now();
    waitFor("the line", [this] { return scanned_; });
    for (size_t i = 1; i <= line_.slaves(); ++i) line_.node(i).setAlarmCurrent(kWholeLine);
    waitFor("the first events", [this] { return told_ == line_.slaves(); });
    execute(kCounter);
    collect();  // what came before does not count
    ordered_json kinds;
    kinds["malformed"] = flood(count, [this] { return malformed(); });
    kinds["oversized"] = flood(count, [this] { return oversized(); });
    kinds["forged"] = flood(count, [this] { return forged(); });
    kinds["replayed"] = flood(count, [this] { return replayed(); });
    const unsigned before = commands_;
    execute(kCounter + 1);
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
    std::sort(times_.begin(), times_.end());
    return {{"kinds", kinds},
            {"commands_before", before},
            {"commands_after", commands_},
            {"accepted", host().accepted},
            {"bus_cycle_us", options_.master.bus_cycle_us},
            {"alarms", times_.size()},
            {"to_report_us", {{"median", times_[times_.size() / 2]}, {"worst", times_.back()}}},
            {"line_frames_bad", line_.linesBad()},
            {"simulated_ms", static_cast<double>(line_.ns()) / 1e6},
            {"wall_s", wall.count()}};
  }

 private:
  const alarm_master& host() { return network_.masterHost()->state(); }

  void waitFor(const char* what, const std::function<bool()>& there, int64_t ms = 20) {
    const int64_t end = line_.ns() + ms * 1'000'000;
    while (!there()) {
      if (line_.ns() > end)
        throw std::runtime_error(std::string(what) + " did not come; " + network_.command({"status"}));
      line_.advance();
    }
  }

  void take(const NibbleFrame& f, const ReportedEvent& e) {
    if (e.kind == PROTOCOL_EVENT_SCANNED && e.position == line_.slaves()) scanned_ = true;
    if (e.kind == PROTOCOL_EVENT_COMMAND) ++commands_;
    if (e.kind != PROTOCOL_EVENT_DETECTOR) return;
    ++told_;
    if (e.position == 0 && e.state == state_ && changed_ >= 0) {
      times_.push_back(static_cast<double>(f.start - changed_) / kUs);
      changed_ = -1;
    }
  }

  // A command with a right code.
  Bytes command(unsigned boot, uint32_t counter, unsigned code, unsigned node) {
    Bytes m = datagramOf(PROTOCOL_KIND_COMMAND);
    putBig(m, options_.master.master_id, 2), putBig(m, boot, 2), putBig(m, counter, 4);
    putBig(m, code, 1), putBig(m, 0, 1), putBig(m, node, 2);
    uint8_t digest[32];
    mbedtls_md_hmac(mbedtls_md_info_from_type(MBEDTLS_MD_SHA256), options_.master.key,
                    sizeof options_.master.key, m.data(), m.size(), digest);
    m.insert(m.end(), digest, digest + PROTOCOL_COMMAND_CODE_BYTES);
    return m;
  }
  Bytes next() {
    return command(server_.boot(), kCounter + 1000 + random_() % 1000, PROTOCOL_ALARM_CLEAR,
                   PROTOCOL_ALL_NODES);
  }
  uint8_t byte(unsigned least = 0) { return static_cast<uint8_t>(least + random_() % (256 - least)); }

  // As a whole or only its headers; none is a command.
  Bytes malformed() {
    Bytes m = next();
    switch (random_() % 8) {
      case 0:
        m.resize(std::min<size_t>(random_() % PROTOCOL_COMMAND_BYTES + 1, PROTOCOL_COMMAND_BYTES - 1));
        break;
      case 1: m[random_() % 6] ^= byte(1); break;  // another beginning, or for another master
      case 2:
        m.assign(1 + random_() % 64, 0);
        for (auto& b : m) b = byte();
        m[0] = 0x45;
        break;
      case 3: m[PROTOCOL_COMMAND_ZERO_AT] = byte(1); break;
      default: {
        Bytes f = server_.frame(m);
        switch (random_() % 5) {
          case 0: f[24 + random_() % 2] ^= byte(1); return f;  // checksum of IP
          case 1: f[40] = byte(1), f[41] = byte(1); return f;  // and of UDP
          case 2: f[38] = byte(1); return f;                   // length of UDP
          case 3:
            f[17] = static_cast<uint8_t>(f[17] + 1 + random_() % 100);
            break;                       // length of IP: more than there is
          default: f[20] = 0x20; break;  // a fragment
        }
        putIpChecksum(f);
        return f;
      }
    }
    return server_.frame(m);
  }
  Bytes oversized() {
    Bytes m = next();
    const size_t longest = random_() % 10 == 0 ? 1472 : 256;
    for (size_t more = 1 + random_() % (longest - m.size()); more > 0; --more) m.push_back(byte());
    return server_.frame(m);
  }
  Bytes forged() {
    static constexpr size_t kCovered[] = {8, 9, 10, 11, 12, 14, 15};
    Bytes m = next();
    if (random_() % 2) m[PROTOCOL_COMMAND_CODE_AT + random_() % (PROTOCOL_COMMAND_CODE_BYTES)] ^= byte(1);
    else m[kCovered[random_() % std::size(kCovered)]] ^= byte(1);
    return server_.frame(m);
  }
  Bytes replayed() {
    const bool otherBoot = random_() % 2;
    const unsigned boot = otherBoot ? server_.boot() + 1 + random_() % 1000 : server_.boot();
    return server_.frame(command(boot, otherBoot ? kCounter + 1000 : random_() % (kCounter + 1),
                                 PROTOCOL_ALARM_CLEAR, PROTOCOL_ALL_NODES));
  }

  void execute(uint32_t counter) {
    const unsigned before = commands_;
    network_.toMaster(
        server_.frame(command(server_.boot(), counter, PROTOCOL_ALARM_CLEAR, PROTOCOL_ALL_NODES)));
    waitFor("the end of a command", [&] { return commands_ == before + 1; });
  }

  // The counters of the controller since this was done last.
  AlarmMasterHost::Counters collect() {
    network_.masterHost()->askCounters();
    waitFor("a look at the counters", [this] { return network_.masterHost()->counters().has_value(); });
    return *network_.masterHost()->counters();
  }

  ordered_json flood(size_t count, const std::function<Bytes()>& make) {
    const alarm_master before = host();
    uint64_t refused = 0, dropped = 0, bad = 0;
    for (size_t sent = 0; sent < count;) {
      const size_t burst = std::min(kBurst, count - sent), middle = burst / 2;
      for (size_t i = 0; i < burst; ++i, ++sent) {
        if (i == middle) {  // an alarm, in the midst of it
          if (changed_ >= 0)
            throw std::runtime_error("an alarm was not reported; " + network_.command({"status"}));
          state_ = PROTOCOL_STATE_NORMAL + PROTOCOL_STATE_ALARM - state_;
          changed_ = line_.now();
          line_.node(1).setAlarmCurrent(state_ == PROTOCOL_STATE_ALARM ? kAlarmCurrent : kWholeLine);
        }
        network_.toMaster(make());
        // Little waits, so that acknowledgements come in between.
        while (line_.plantBacklog() > kBacklog) line_.advance();
      }
      waitFor("the report of an alarm", [this] { return changed_ < 0 && line_.plantBacklog() == 0; });
      const int64_t taken = line_.ns() + 10'000;  // the host has taken the last one
      waitFor("some time", [&] { return line_.ns() >= taken; });
      const auto counters = collect();
      refused += counters[0], dropped += counters[1], bad += counters[3];
    }
    const alarm_master& after = host();
    return {{"sent", count},
            {"refused", refused},
            {"dropped", dropped},
            {"malformed", after.malformed - before.malformed},
            {"forged", after.forged - before.forged},
            {"replayed", after.replayed - before.replayed},
            {"bad_frames", bad}};
  }

  AlarmNetwork& network_;
  AlarmLine& line_;
  ReportServer server_;
  const AlarmOptions& options_;
  std::mt19937_64 random_;
  bool scanned_ = false;
  size_t told_ = 0;        // events of detectors
  unsigned commands_ = 0;  // whose end was reported
  unsigned state_ = PROTOCOL_STATE_NORMAL;
  Time changed_ = -1;  // when the first detector got there; it has been reported
  std::vector<double> times_;
};
}  // namespace

ordered_json floodMaster(AlarmNetwork& network, const AlarmOptions& options, size_t count) {
  return Flood(network, options).run(count);
}
