#include "alarm/network.h"

#include <algorithm>

#include "core/esc.h"
#include "core/user_error.h"

namespace {
using nlohmann::ordered_json;

// A node is without power for so long when it is restarted: long enough for the master to miss a slave.
constexpr int64_t kOffCycles = 40;

// What is at the master's board, by its bit.
struct Contact {
  const char* name;
  size_t number;
};
constexpr Contact kButtons[] = {{"silence", 0}, {"acknowledge", 1}, {"reset", 2}, {"test", 3}};
constexpr Contact kFaults[] = {{"mains", 4}, {"battery", 5}, {"earth", 6}};
static_assert(BOARD_SILENCE == 1 << 0 && BOARD_ACKNOWLEDGE == 1 << 1 && BOARD_RESET == 1 << 2 &&
              BOARD_TEST == 1 << 3 && BOARD_MAINS_FAILED == 1 << 4 && BOARD_BATTERY_LOW == 1 << 5 &&
              BOARD_EARTH_FAULT == 1 << 6);

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
      boards_(options.line.slaves + 1),
      lineRecord_(recorder(options.linePcap)),
      plantRecord_(recorder(options.plantPcap)),
      line_(options.line, [this](size_t node) { return makeHost(node); }) {
  const size_t slaves = options.line.slaves;
  labels_.resize(slaves), zones_.resize(slaves), places_.resize(slaves);
  // As the page calls them: two in a zone.
  for (size_t i = 0; i < slaves; ++i) {
    labels_[i] = std::to_string(i / 2 + 1) + (i % 2 ? "B" : "A");
    zones_[i] = "zone " + std::to_string(i / 2 + 1);
    places_[i] = {static_cast<uint16_t>(options.slave.node_id + i), labels_[i].c_str(), zones_[i].c_str()};
  }
  options_.master.panel.places = places_.data();
  options_.master.panel.place_count = static_cast<uint8_t>(options.listed ? slaves : 0);
  for (size_t i = 0; i <= slaves; ++i) {
    boards_[i].name = i == 0 ? "master" : "slave" + std::to_string(i);
    boards_[i].store = options.state / boards_[i].name;
    nodeIds_.push_back(static_cast<uint16_t>(options.slave.node_id + i - 1));
  }
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
  if (node == 0) return std::make_unique<AlarmMasterHost>(boards_[0], options_.master);
  alarm_slave_parameters parameters = options_.slave;
  parameters.node_id = nodeIds_[node];
  return std::make_unique<AlarmSlaveHost>(boards_[node], parameters);
}

void AlarmNetwork::toMaster(const Bytes& frame) { line_.sendToPlant(frame); }

size_t AlarmNetwork::slaveNumbered(const std::string& text) const { return number(text, line_.slaves()); }
size_t AlarmNetwork::nodeNamed(const std::string& text) const {
  return text == "master" ? 0 : slaveNumbered(text);
}

// One detector or all of them, at the same moment.
void AlarmNetwork::change(const std::string& slaves, const std::function<void(SmokeDetector&)>& how) {
  const bool all = slaves == "all";
  const size_t first = all ? 1 : slaveNumbered(slaves), last = all ? line_.slaves() : first;
  for (size_t i = first; i <= last; ++i) {
    how(line_.detector(i));
    line_.updateDetector(i);
  }
}

// One cable or all of them.
void AlarmNetwork::noise(const std::string& cables, uint64_t bits) {
  const bool all = cables == "all";
  const size_t first = all ? 1 : number(cables, line_.cables()), last = all ? line_.cables() : first;
  for (size_t i = first; i <= last; ++i) line_.setNoise(i, bits);
}

// Detectors, cables.
bool AlarmNetwork::commandOfLine(const std::vector<std::string>& words) {
  const std::string &verb = words[0], &last = words.back();
  const size_t count = words.size();
  if (verb == "smoke" && count == 3 && (last == "on" || last == "off")) {
    change(words[1], [&](SmokeDetector& d) { d.setSmoke(last == "on"); });
  } else if (verb == "line" && count == 3 && (last == "open" || last == "short" || last == "whole")) {
    using Line = SmokeDetector::Line;
    change(words[1], [&](SmokeDetector& d) {
      d.setLine(last == "open" ? Line::open : last == "short" ? Line::shorted : Line::whole);
    });
  } else if (verb == "chatter" && (count == 3 || count == 4)) {
    const std::string to = count == 4 ? last : "alarm";
    if (to != "alarm" && to != "open" && to != "short") return false;
    const size_t hz = words[2] == "off" ? 0 : number(words[2], 100'000);
    line_.setChatter(slaveNumbered(words[1]), static_cast<double>(hz),
                     to == "alarm"  ? esc::kAlarmCurrent
                     : to == "open" ? esc::kNoCurrent
                                    : esc::kShortCircuit);
  } else if ((verb == "cut" || verb == "mend") && count == 2) {
    line_.setCable(number(words[1], line_.cables()), verb == "mend");
  } else if (verb == "noise" && count == 3) {
    noise(words[1], last == "off" ? 0 : number(last, 1'000'000));
  } else {
    return false;
  }
  return true;
}

// The program of a node's host: it ends, starts anew, or takes longer for each pass.
void AlarmNetwork::host(size_t node, const std::vector<std::string>& how) {
  if (how.size() == 2) {
    double& ms = how[0] == "slow" ? boards_[node].slowMs : boards_[node].bootMs;
    ms = how[1] == "0" ? 0 : static_cast<double>(number(how[1], 100'000));
  } else {
    line_.setHost(node, how[0] == "start");
  }
}

// What a host program has done that has ended since.
void AlarmNetwork::write(size_t node, const std::string& address, const std::string& value) {
  const bool isHex = address.size() == 6 && address.compare(0, 2, "0x") == 0 &&
                     address.find_first_not_of("0123456789abcdef", 2) == std::string::npos;
  if (!isHex) throw UserError("'" + address + "' is no address from 0x0000 to 0xffff.");
  const auto byte = static_cast<uint8_t>(value == "0" ? 0 : number(value, 255));
  if (!line_.writeRegister(node, static_cast<uint16_t>(std::stoul(address, nullptr, 16)), byte))
    throw UserError("the host program of " + boards_[node].name + " runs, or it has no power.");
}

// Power, host, storage, configuration.
bool AlarmNetwork::commandOfNode(const std::vector<std::string>& words) {
  const std::string &verb = words[0], &last = words.back();
  const size_t count = words.size();
  if (verb == "restart" && (count == 2 || count == 3)) {
    const int64_t offUs = count == 3 ? static_cast<int64_t>(number(last, 1'000'000))
                                     : kOffCycles * options_.master.bus_cycle_us;
    line_.restart(nodeNamed(words[1]), offUs * 1000);
  } else if ((verb == "off" || verb == "on") && count == 2) {
    line_.setPower(nodeNamed(words[1]), verb == "on");
  } else if (verb == "host" && count == 3 && (last == "stop" || last == "start")) {
    host(nodeNamed(words[1]), {last});
  } else if (verb == "host" && count == 4 && (words[2] == "slow" || words[2] == "boot")) {
    host(nodeNamed(words[1]), {words[2], last});
  } else if (verb == "node" && count == 3) {
    nodeIds_[slaveNumbered(words[1])] = static_cast<uint16_t>(number(last, PROTOCOL_ALL_NODES));
  } else if (verb == "write" && count == 4) {
    write(nodeNamed(words[1]), words[2], last);
  } else if (verb == "storage" && count == 3 && (last == "fail" || last == "ok")) {
    boards_[nodeNamed(words[1])].storageWorks = last == "ok";
  } else if (verb == "configuration" && count == 3 && (last == "fail" || last == "ok")) {
    line_.node(nodeNamed(words[1])).setConfigurationFault(last == "fail");
  } else {
    return false;
  }
  return true;
}

// For four times as long as a contact may bounce, or as said.
void AlarmNetwork::press(const std::string& button, int64_t ms) {
  for (const Contact& b : kButtons)
    if (button == b.name) boards_[0].pressed[b.number] = line_.now() + ms * 1000 * kUs;
}

bool AlarmNetwork::commandOfPanel(const std::vector<std::string>& words) {
  const std::string &verb = words[0], &last = words.back();
  const size_t count = words.size();
  const auto isButton = [&](const Contact& b) { return count > 1 && words[1] == b.name; };
  if (verb == "press" && (count == 2 || count == 3) &&
      std::any_of(std::begin(kButtons), std::end(kButtons), isButton)) {
    press(words[1], count == 3 ? static_cast<int64_t>(number(last, 100'000))
                               : 4 * std::max<int64_t>(1, options_.master.panel.bounce_ms));
    return true;
  }
  for (const Contact& f : kFaults)
    if (verb == f.name && count == 2 && (last == "fail" || last == "ok")) {
      const auto bit = static_cast<uint8_t>(1 << f.number);
      uint8_t& contacts = boards_[0].contacts;
      contacts = static_cast<uint8_t>(last == "fail" ? contacts | bit : contacts & ~bit);
      return true;
    }
  return false;
}

std::string AlarmNetwork::command(const std::vector<std::string>& words) {
  const size_t count = words.size();
  if (count > 0) {
    if (words[0] == "status" && count == 1) return status().dump();
    if (words[0] == "time" && count == 1) return std::to_string(line_.ns()) + " ns";
    if (words[0] == "log" && count <= 2)
      return log(count == 2 ? static_cast<uint32_t>(number(words[1], BOARD_LOG_RECORDS)) : 20).dump();
    if (commandOfLine(words) || commandOfNode(words) || commandOfPanel(words)) return "";
  }
  throw UserError(
      "known: smoke SLAVE|all on|off, line SLAVE|all open|short|whole, chatter SLAVE HZ|off "
      "[alarm|open|short], "
      "cut CABLE, mend CABLE, noise CABLE|all BITS|off, restart NODE [MICROSECONDS], off NODE, on NODE, "
      "host NODE stop|start|slow MS|boot MS, node SLAVE ID, write NODE ADDRESS BYTE, storage NODE fail|ok, "
      "configuration NODE fail|ok, press silence|acknowledge|reset|test [MS], "
      "mains|battery|earth fail|ok, log [N], status, time, quit; a NODE is a slave or 'master'; the first "
      "slave "
      "is 1, as is the cable before it.");
}

ordered_json AlarmNetwork::statusOfBoard(size_t node) {
  const BoardHardware& b = boards_[node];
  const bool there = line_.node(node).host() != nullptr;
  return {{"host", !there         ? "stopped"
                   : b.slowMs > 0 ? "slow"
                                  : "running"},
          {"watchdog_us", (line_.now() - b.watched) / kUs},
          {"storage", b.storageWorks ? "ok" : "fail"},
          {"configuration", line_.node(node).configurationFault() ? "fail" : "ok"},
          {"notice", b.notices.empty() ? "" : b.notices.back()}};
}

ordered_json AlarmNetwork::statusOf(size_t i) {
  const SmokeDetector& d = line_.detector(i);
  ordered_json s = {{"slave", i},
                    {"powered", line_.powered(i)},
                    {"cable", line_.cable(i) ? "whole" : "cut"},
                    {"smoke", d.smoke()},
                    {"line", nameOf(d.line())},
                    {"chatter_hz", line_.chatter(i)},
                    {"detector_alarm", d.latched()},
                    {"supply", line_.node(i).alarmSupply()},
                    {"buzzer", line_.node(i).alarmBuzzer()},
                    {"lamp", line_.node(i).alarmLamp()}};
  s.update(statusOfBoard(i));
  if (const auto* host = static_cast<AlarmSlaveHost*>(line_.node(i).host())) {
    s["node_id"] = host->state().parameters.node_id;
    s["epoch"] = host->state().epoch;
    s["self_test"] = host->state().self_test;
    s["broadcasts"] = host->state().broadcasts;
    s["messages"] = host->state().messages;
  }
  return s;
}

ordered_json AlarmNetwork::statusOfMaster() {
  const Slave& pins = line_.node(0);
  const BoardHardware& board = boards_[0];
  ordered_json display = ordered_json::array();
  for (const std::string& line : board.display)
    if (!line.empty()) display.push_back(line);
  ordered_json master = {{"powered", line_.powered(0)},    {"fire", pins.alarmFire()},
                         {"fault", pins.alarmFault()},     {"disabled", pins.alarmDisabled()},
                         {"sounder", pins.alarmSounder()}, {"display", display}};
  master.update(statusOfBoard(0));
  for (const Contact& f : kFaults) master[f.name] = board.contacts >> f.number & 1 ? "fail" : "ok";
  if (const auto* host = masterHost()) {
    const alarm_master& m = host->state();
    master["line_life"] = m.line_life;
    master["self_test"] = m.self_test;
    master["line_moves"] = m.line_moves;
    master["host_faults"] = m.faults;
    master["status"] = m.picture.state;
    master["alarms"] = m.picture.alarms;
    master["orders"] = m.orders;
    master["malformed"] = m.malformed;
    master["untold"] = m.untold;
    master["logged"] = m.log.last;
  }
  return master;
}

// The newest records, the newest first; without a host there are none.
ordered_json AlarmNetwork::log(uint32_t count) {
  ordered_json records = ordered_json::array();
  if (!masterHost()) return records;
  for (const log_record& r : masterHost()->log(count))
    records.push_back({{"number", r.number},
                       {"time_us", r.time_us},
                       {"life", r.life},
                       {"kind", r.kind},
                       {"position", r.position},
                       {"node", r.node},
                       {"detail", r.detail}});
  return records;
}

ordered_json AlarmNetwork::status() {
  ordered_json slaves = ordered_json::array(), cables = ordered_json::array();
  for (size_t i = 1; i <= line_.slaves(); ++i) slaves.push_back(statusOf(i));
  for (size_t i = 1; i <= line_.cables(); ++i) cables.push_back(line_.cable(i) ? "whole" : "cut");
  return {{"time_us", static_cast<double>(line_.ns()) / 1000},
          {"master", statusOfMaster()},
          {"slaves", slaves},
          {"cables", cables},
          {"line",
           {{"sent", line_.linesSent()},
            {"back", line_.linesBack()},
            {"bad", line_.linesBad()},
            {"bits_flipped", line_.bitsFlipped()}}},
          {"plant", {{"from_master", fromMaster_}, {"to_master", toMaster_}}}};
}
