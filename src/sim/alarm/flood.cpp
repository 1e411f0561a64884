#include "alarm/flood.h"

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

constexpr size_t kBurst = 250;    // counters of the controller stop at 255
constexpr size_t kBacklog = 200;  // nibbles that may wait for the cable
constexpr size_t kRecorded = 50;  // answers that an attacker has written down

class Flood {
 public:
  Flood(AlarmNetwork& network, const AlarmOptions& options)
      : network_(network),
        line_(network.line()),
        server_(network, options),
        options_(options),
        random_(options.line.seed) {
    server_.onEvent = [this](const NibbleFrame& f, const ReportedEvent& e) { take(f, e); };
  }

  ordered_json run(size_t count) {
    const auto begin = std::chrono::steady_clock::now();
    waitFor("the line", [this] { return isComplete(server_, line_.slaves()); });
    for (size_t i = 1; i <= line_.slaves(); ++i) line_.node(i).setAlarmCurrent(kWholeLine);
    waitFor("the first events", [this] { return told_ >= line_.slaves(); });
    record();
    execute();
    collect();  // what came before does not count
    ordered_json kinds;
    kinds["malformed"] = flood(count, [this] { return server_.frame(malformed()); });
    kinds["headers"] = flood(count, [this] { return headers(); });
    kinds["oversized"] = flood(count, [this] { return server_.frame(oversized()); });
    kinds["wrong_tag"] = flood(count, [this] { return server_.frame(wrongTag()); });
    kinds["other_key"] = flood(count, [this] { return server_.frame(otherKey()); });
    kinds["changed"] = flood(count, [this] { return server_.frame(changed()); });
    kinds["replayed"] = flood(count, [this] { return server_.frame(replayed()); });
    kinds["other_life"] = flood(count, [this] { return server_.frame(otherLife()); });
    kinds["reflected"] = flood(count, [this] { return server_.frame(server_.report()); });
    const unsigned before = commands_;
    execute();
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
    std::sort(times_.begin(), times_.end());
    return {{"kinds", kinds},
            {"commands_before", before},
            {"commands_after", commands_},
            {"orders", network_.masterHost()->state().orders},
            {"server_silent", (server_.line().status & PROTOCOL_MASTER_SERVER_SILENT) != 0},
            {"reports_refused", server_.refused()},
            {"bus_cycle_us", options_.master.bus_cycle_us},
            {"alarms", times_.size()},
            {"to_report_us", {{"median", times_[times_.size() / 2]}, {"worst", times_.back()}}},
            {"line_frames_bad", line_.linesBad()},
            {"simulated_ms", static_cast<double>(line_.ns()) / 1e6},
            {"wall_s", wall.count()}};
  }

 private:
  void waitFor(const char* what, const std::function<bool()>& there, int64_t ms = 30) {
    const int64_t end = line_.ns() + ms * 1'000'000;
    while (!there()) {
      if (line_.ns() > end)
        throw std::runtime_error(std::string(what) + " did not come; " + network_.command({"status"}));
      line_.advance();
    }
  }

  void take(const NibbleFrame& f, const ReportedEvent& e) {
    if (e.kind == PROTOCOL_EVENT_COMMAND) ++commands_;
    if (e.kind != PROTOCOL_EVENT_DETECTOR) return;
    ++told_;
    if (e.position == 0 && e.state == state_ && changed_ >= 0) {
      times_.push_back(static_cast<double>(f.start - changed_) / kUs);
      changed_ = -1;
    }
  }

  uint8_t byte(unsigned least = 0) { return static_cast<uint8_t>(least + random_() % (256 - least)); }
  void spoil(Bytes& b, size_t from, size_t bytes) { b[from + random_() % bytes] ^= byte(1); }

  // A real answer of the server: what is made from it must not count. With an order, which would show.
  Bytes real() {
    Bytes a = server_.answer();
    a[PROTOCOL_ANSWER_ORDER_AT] = PROTOCOL_ORDER_RESET;
    a[PROTOCOL_ANSWER_NODE_AT] = a[PROTOCOL_ANSWER_NODE_AT + 1] = 0xff;
    for (int i = 0; i < 4; ++i) a[PROTOCOL_ANSWER_TICKET_AT + i] = byte(1);
    ReportServer::tag(a, options_.master.key);
    return a;
  }

  // What an attacker can write down.
  void record() {
    while (recorded_.size() < kRecorded) recorded_.push_back(server_.answer());
    const Bytes later = server_.answer();
    waitFor("a later answer", [&] { return echoOf(server_.answer()) > echoOf(later) + 2; });
  }
  static uint32_t echoOf(const Bytes& answer) { return big(answer, PROTOCOL_ANSWER_ECHO_AT, 4); }

  // Another beginning, for another master, too short, or anything; its tag is right as far as it can be.
  Bytes malformed() {
    Bytes a = real();
    switch (random_() % 4) {
      case 0: a.resize(random_() % PROTOCOL_ANSWER_BYTES); return a;
      case 1: spoil(a, 0, PROTOCOL_ANSWER_ZERO_AT); break;
      case 2: a[PROTOCOL_ANSWER_KIND_AT] = PROTOCOL_KIND_REPORT; break;
      default: {
        Bytes any(1 + random_() % 128);
        for (auto& b : any) b = byte();
        any[0] = 0x45;
        return any;
      }
    }
    ReportServer::tag(a, options_.master.key);
    return a;
  }
  // A real answer within headers that do not fit, with right checksums.
  Bytes headers() {
    Bytes f = server_.frame(real());
    switch (random_() % 3) {
      case 0: f[38] = byte(1); return f;  // length of UDP
      case 1:
        f[17] = static_cast<uint8_t>(f[17] + 1 + random_() % 100);
        break;                       // length of IP: more than there is
      default: f[20] = 0x20; break;  // a fragment
    }
    putIpChecksum(f);
    return f;
  }
  Bytes oversized() {
    Bytes a = real();
    const size_t longest = random_() % 10 == 0 ? 1472 : 256;
    for (size_t more = 1 + random_() % (longest - a.size()); more > 0; --more) a.push_back(byte());
    return a;
  }
  // One bit of it, or all.
  Bytes wrongTag() {
    Bytes a = real();
    if (random_() % 2) a[PROTOCOL_ANSWER_TAG_AT + random_() % PROTOCOL_TAG_BYTES] ^= 1 << random_() % 8;
    else
      for (size_t i = 0; i < PROTOCOL_TAG_BYTES; ++i) a[PROTOCOL_ANSWER_TAG_AT + i] = byte();
    return a;
  }
  Bytes otherKey() {
    uint8_t key[PROTOCOL_KEY_BYTES];
    std::copy(std::begin(options_.master.key), std::end(options_.master.key), key);
    key[random_() % PROTOCOL_KEY_BYTES] ^= static_cast<uint8_t>(1 << random_() % 8);
    Bytes a = real();
    ReportServer::tag(a, key);
    return a;
  }
  // One bit between the head and the tag, which stays.
  Bytes changed() {
    Bytes a = real();
    a[PROTOCOL_ANSWER_TURN_AT + random_() % (PROTOCOL_ANSWER_TAG_AT - PROTOCOL_ANSWER_TURN_AT)] ^=
        static_cast<uint8_t>(1 << random_() % 8);
    return a;
  }
  // As it was sent once.
  Bytes replayed() { return recorded_[random_() % recorded_.size()]; }
  // Right for an earlier life of the master.
  Bytes otherLife() {
    Bytes a = real();
    spoil(a, PROTOCOL_ANSWER_LIFE_AT, PROTOCOL_LIFE_BYTES);
    ReportServer::tag(a, options_.master.key);
    return a;
  }

  // An order of the server itself.
  void execute() {
    const unsigned before = commands_;
    server_.order(PROTOCOL_ORDER_SILENCE, PROTOCOL_ALL_NODES);
    waitFor("the end of an order", [&] { return commands_ == before + 1; });
  }

  // The counters of the controller since this was done last.
  AlarmMasterHost::Counters collect() {
    network_.masterHost()->askCounters();
    waitFor("a look at the counters", [this] { return network_.masterHost()->counters().has_value(); });
    return *network_.masterHost()->counters();
  }

  ordered_json flood(size_t count, const std::function<Bytes()>& make) {
    const uint32_t orders = network_.masterHost()->state().orders;
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
        // Little waits, so that answers come in between.
        while (line_.plantBacklog() > kBacklog) line_.advance();
      }
      waitFor("the report of an alarm", [this] { return changed_ < 0 && line_.plantBacklog() == 0; });
      const int64_t taken = line_.ns() + 30'000;  // the controller has checked the last one
      waitFor("some time", [&] { return line_.ns() >= taken; });
      const auto counters = collect();
      refused += counters[0], dropped += counters[1], bad += counters[3];
    }
    return {{"sent", count},
            {"refused", refused},
            {"dropped", dropped},
            {"orders", network_.masterHost()->state().orders - orders},
            {"bad_frames", bad}};
  }

  AlarmNetwork& network_;
  AlarmLine& line_;
  ReportServer server_;
  const AlarmOptions& options_;
  std::mt19937_64 random_;
  std::vector<Bytes> recorded_;
  size_t told_ = 0;        // events of detectors
  unsigned commands_ = 0;  // whose end was reported
  unsigned state_ = PROTOCOL_STATE_NORMAL;
  Time changed_ = -1;  // when the first detector got there; -1: it has been reported
  std::vector<double> times_;
};
}  // namespace

ordered_json floodMaster(AlarmNetwork& network, const AlarmOptions& options, size_t count) {
  return Flood(network, options).run(count);
}
