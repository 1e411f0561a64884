#include "alarm/network.h"

#include <algorithm>

#include "core/user_error.h"

namespace {
using nlohmann::ordered_json;

// A node is without power for so long when it is restarted: long enough for the master to miss a slave.
constexpr int64_t kOffCycles = 40;

const char* nameOf(SmokeDetector::Line line) {
  return line == SmokeDetector::Line::whole ? "whole" : line == SmokeDetector::Line::open ? "open" : "short";
}

size_t number(const std::string& text, size_t most) {
  const bool digits =
      !text.empty() && text.size() < 10 && text.find_first_not_of("0123456789") == std::string::npos;
  if (!digits || std::stoul(text) < 1 || std::stoul(text) > most)
    throw UserError("'" + text + "' is no number from 1 to " + std::to_string(most) + ".");
  return std::stoul(text);
}

std::unique_ptr<CaptureWriter> recorder(const std::string& path) {
  return path.empty() ? nullptr : std::make_unique<CaptureWriter>(path);
}
}  // namespace

AlarmNetwork::AlarmNetwork(const AlarmOptions& options)
    : options_(options),
      lineRecord_(recorder(options.linePcap)),
      plantRecord_(recorder(options.plantPcap)),
      line_(options.line, [this](size_t node) { return makeHost(node); }) {
  const auto record = [](CaptureWriter* to, const NibbleFrame& f, const Bytes& bytes) {
    if (to && !bytes.empty()) to->write(f.end / kNs, bytes);
  };
  line_.onLineOut = line_.onLineBack = [=](const NibbleFrame& f, const Bytes& bytes) {
    record(lineRecord_.get(), f, bytes);
  };
  line_.onToMaster = [=](const NibbleFrame& f, const Bytes& bytes) {
    ++toMaster_;
    record(plantRecord_.get(), f, bytes);
  };
  line_.onFromMaster = [=](const NibbleFrame& f, const Bytes& bytes) {
    ++fromMaster_;
    record(plantRecord_.get(), f, bytes);
    if (onFromMaster) onFromMaster(f, bytes);
  };
}

std::unique_ptr<Host> AlarmNetwork::makeHost(size_t node) {
  if (node == 0) return std::make_unique<AlarmMasterHost>("master", options_.state, options_.master);
  alarm_slave_parameters parameters = options_.slave;
  parameters.node_id = static_cast<uint16_t>(parameters.node_id + node - 1);
  return std::make_unique<AlarmSlaveHost>("slave" + std::to_string(node), options_.state, parameters);
}

void AlarmNetwork::toMaster(const Bytes& frame) { line_.sendToPlant(frame); }

size_t AlarmNetwork::slaveNumbered(const std::string& text) const { return number(text, line_.slaves()); }

// One detector or all of them, at the same moment.
void AlarmNetwork::change(const std::string& slaves, const std::function<void(SmokeDetector&)>& how) {
  const bool all = slaves == "all";
  const size_t first = all ? 1 : slaveNumbered(slaves), last = all ? line_.slaves() : first;
  for (size_t i = first; i <= last; ++i) {
    how(line_.detector(i));
    line_.updateDetector(i);
  }
}

std::string AlarmNetwork::command(const std::vector<std::string>& words) {
  const std::string verb = words.empty() ? "" : words[0], last = words.empty() ? "" : words.back();
  const size_t count = words.size();
  if (verb == "smoke" && count == 3 && (last == "on" || last == "off")) {
    change(words[1], [&](SmokeDetector& d) { d.setSmoke(last == "on"); });
  } else if (verb == "line" && count == 3 && (last == "open" || last == "short" || last == "whole")) {
    using Line = SmokeDetector::Line;
    change(words[1], [&](SmokeDetector& d) {
      d.setLine(last == "open" ? Line::open : last == "short" ? Line::shorted : Line::whole);
    });
  } else if ((verb == "cut" || verb == "mend") && count == 2) {
    line_.setCable(slaveNumbered(words[1]), verb == "mend");
  } else if (verb == "restart" && (count == 2 || count == 3)) {
    const int64_t offUs = count == 3 ? static_cast<int64_t>(number(last, 1'000'000))
                                     : kOffCycles * options_.master.bus_cycle_us;
    line_.restart(words[1] == "master" ? 0 : slaveNumbered(words[1]), offUs * 1000);
  } else if (verb == "status" && count == 1) {
    return status().dump();
  } else if (verb == "time" && count == 1) {
    return std::to_string(line_.ns()) + " ns";
  } else {
    throw UserError(
        "known: smoke SLAVE|all on|off, line SLAVE|all open|short|whole, cut SLAVE, mend SLAVE, restart "
        "SLAVE|master [MICROSECONDS], status, time, quit; "
        "the first slave is 1.");
  }
  return "";
}

ordered_json AlarmNetwork::statusOf(size_t i) {
  const SmokeDetector& d = line_.detector(i);
  ordered_json s = {{"slave", i},
                    {"powered", line_.powered(i)},
                    {"cable", line_.cable(i) ? "whole" : "cut"},
                    {"smoke", d.smoke()},
                    {"line", nameOf(d.line())},
                    {"detector_alarm", d.latched()},
                    {"supply", line_.node(i).alarmSupply()},
                    {"buzzer", line_.node(i).alarmBuzzer()},
                    {"lamp", line_.node(i).alarmLamp()}};
  if (const auto* host = static_cast<AlarmSlaveHost*>(line_.node(i).host())) {
    s["node_id"] = host->state().parameters.node_id;
    s["epoch"] = host->state().epoch;
    s["self_test"] = host->state().self_test;
    s["broadcasts"] = host->state().broadcasts;
    s["messages"] = host->state().messages;
    s["last_broadcast"] = host->state().last_broadcast[0];
    s["last_message"] = host->state().last_message[0];
    s["failure"] = host->failure();
  }
  return s;
}

ordered_json AlarmNetwork::status() {
  ordered_json master = {{"powered", line_.powered(0)},
                         {"buzzer", line_.node(0).alarmBuzzer()},
                         {"lamp", line_.node(0).alarmLamp()}};
  if (const auto* host = static_cast<AlarmMasterHost*>(line_.node(0).host())) {
    const alarm_master& m = host->state();
    master["boot"] = m.boot;
    master["self_test"] = m.self_test;
    master["accepted"] = m.accepted;
    master["malformed"] = m.malformed;
    master["forged"] = m.forged;
    master["replayed"] = m.replayed;
    master["untold"] = m.untold;
    master["failure"] = host->failure();
  }
  ordered_json slaves = ordered_json::array();
  for (size_t i = 1; i <= line_.slaves(); ++i) slaves.push_back(statusOf(i));
  return {{"time_us", static_cast<double>(line_.ns()) / 1000},
          {"master", master},
          {"slaves", slaves},
          {"line",
           {{"sent", line_.linesSent()},
            {"back", line_.linesBack()},
            {"bad", line_.linesBad()},
            {"bits_flipped", line_.bitsFlipped()}}},
          {"plant", {{"from_master", fromMaster_}, {"to_master", toMaster_}}}};
}
