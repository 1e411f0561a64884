#include "ring/bench.h"

#include <algorithm>

#include "core/user_error.h"

namespace {
using nlohmann::ordered_json;
using Words = std::vector<std::string>;

uint64_t number(const std::string& text, uint64_t high, uint64_t low = 0) {
  if (text.empty() || text.size() > 18 || text.find_first_not_of("0123456789") != std::string::npos ||
      std::stoull(text) > high || std::stoull(text) < low)
    throw UserError("'" + text + "' is no whole number from " + std::to_string(low) + " to " +
                    std::to_string(high) + ".");
  return std::stoull(text);
}

uint64_t number16(const std::string& digits, uint64_t high) {
  const uint64_t n = std::stoull(digits, nullptr, 16);
  if (n > high) throw UserError("'" + digits + "' is no identifier of as many bits.");
  return n;
}

double real(const std::string& text, double low, double high) {
  size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
  }
  if (used != text.size() || used == 0 || !(value >= low && value <= high))
    throw UserError("'" + text + "' is no number from " + ordered_json(low).dump() + " to " +
                    ordered_json(high).dump() + ".");
  return value;
}

Bytes bytesOf(const std::string& text, size_t most) {
  if (text.size() % 2 || text.size() > 2 * most ||
      text.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos)
    throw UserError("'" + text.substr(0, 20) + "' is not hex digits, two for each of up to " +
                    std::to_string(most) + " bytes.");
  Bytes bytes;
  for (size_t i = 0; i < text.size(); i += 2)
    bytes.push_back(static_cast<uint8_t>(std::stoul(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

// As candump writes it: 123#0011, 00000123#, 123#R4.
CanFrame canFrame(const std::string& text) {
  const size_t hash = text.find('#');
  const std::string id = text.substr(0, hash), rest = hash == std::string::npos ? "" : text.substr(hash + 1);
  const bool isHex = id.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
  if (hash == std::string::npos || !isHex || (id.size() != 3 && id.size() != 8))
    throw UserError("'" + text.substr(0, 30) + "' is no frame like 123#0011 or 00000123#R.");
  CanFrame f;
  f.extended = id.size() == 8;
  f.id = static_cast<uint32_t>(number16(id, f.extended ? 0x1fffffff : 0x7ff));
  f.remote = !rest.empty() && rest[0] == 'R';
  if (f.remote) {
    f.dlc = static_cast<uint8_t>(rest.size() > 1 ? number(rest.substr(1), 8) : 0);
    return f;
  }
  const Bytes data = bytesOf(rest, 8);
  f.dlc = static_cast<uint8_t>(data.size());
  std::copy(data.begin(), data.end(), f.data.begin());
  return f;
}

std::string digits(const Bytes& bytes) {
  std::string text;
  char two[3];
  for (uint8_t b : bytes) std::snprintf(two, sizeof two, "%02x", b), text += two;
  return text;
}

const char* nameOf(transport_outcome outcome) {
  switch (outcome) {
    case TRANSPORT_IS_DELIVERED: return "delivered";
    case TRANSPORT_IS_REFUSED: return "refused";
    default: return "not confirmed";
  }
}

const char* nameOf(ring_node_fault fault) {
  switch (fault) {
    case RING_NODE_GOOD: return "good";
    case RING_NODE_NO_CONTROLLER: return "no controller";
    case RING_NODE_SETTINGS: return "settings";
    default: return "store";
  }
}

const std::pair<const char*, Fibre::Stuck> kStuck[] = {{"no", Fibre::Stuck::no},
                                                       {"dark", Fibre::Stuck::dark},
                                                       {"light", Fibre::Stuck::light},
                                                       {"dominant", Fibre::Stuck::dominant},
                                                       {"recessive", Fibre::Stuck::recessive}};

const char* nameOf(Fibre::Stuck stuck) {
  for (const auto& [name, value] : kStuck)
    if (value == stuck) return name;
  return "";
}
}  // namespace

size_t RingBench::node(const std::string& text) const { return number(text, ring_.size(), 1) - 1; }

RingNodeHost& RingBench::program(const std::string& text) {
  RingNodeHost* host = ring_.program(node(text));
  if (!host) throw UserError("the host program of node " + text + " does not run, or is another one.");
  return *host;
}

// Which of the two fibres between a node and the next: both, if nothing is said.
bool RingBench::commandOfFibre(const Words& words) {
  const std::string& verb = words[0];
  if (verb == "optics" && words.size() >= 4) return optics(words), true;
  if (verb == "pair" && words.size() == 3 && (words[2] == "dominant" || words[2] == "free"))
    return ring_.holdPair(words[1], words[2] == "dominant"), true;
  const bool isCut = verb == "cut" || verb == "mend", isStuck = verb == "stuck";
  if ((isCut && (words.size() == 2 || words.size() == 3)) || (isStuck && words.size() == 4)) {
    const size_t i = number(words[1], ring_.fibres(), 1) - 1;
    const std::string way = words.size() > 2 ? words[2] : "both";
    if (way != "there" && way != "back" && way != "both")
      throw UserError("'" + way + "' is no way on a fibre; known: there, back, both.");
    const auto act = [&](Fibre& f) {
      if (isCut) return f.setWhole(verb == "mend");
      for (const auto& [name, value] : kStuck)
        if (words[3] == name) return f.setStuck(value);
      throw UserError("'" + words[3] +
                      "' is nothing a module is stuck at; known: no, dark, light, dominant, recessive.");
    };
    if (way != "back") act(ring_.there(i));
    if (way != "there") act(ring_.back(i));
    return true;
  }
  return false;
}

void RingBench::optics(const Words& words) {
  const size_t first = words[1] == "all" ? 1 : number(words[1], ring_.fibres(), 1);
  const size_t last = words[1] == "all" ? ring_.fibres() : first;
  const std::string &what = words[2], &value = words[3];
  const auto change = [&](Optics& o) {
    const uint64_t most = 1'000'000'000'000;
    if (words.size() != 4) throw UserError("'optics' takes a fibre or 'all', what is wrong, and how much.");
    if (what == "errors") o.bitErrors = number(value, most);
    else if (what == "missing") o.missing = number(value, most);
    else if (what == "extra") o.extra = number(value, most);
    else if (what == "jitter") o.jitterNs = real(value, 0, Fibre::kMostJitterNs);
    else if (what == "duty") o.dutyPercent = real(value, Fibre::kLeastDutyPercent, Fibre::kMostDutyPercent);
    else if (what == "attenuation") o.attenuationDb = real(value, 0, 100);
    else
      throw UserError("'" + what +
                      "' is nothing that is wrong with light; known: errors, missing, extra, jitter, duty, "
                      "attenuation.");
  };
  for (size_t i = first; i <= last; ++i)
    for (Fibre* f : {&ring_.there(i - 1), &ring_.back(i - 1)}) {
      change(f->optics());
      f->changed();
    }
}

bool RingBench::commandOfNode(const Words& words) {
  const std::string &verb = words[0], &last = words.back();
  const size_t count = words.size();
  if ((verb == "off" || verb == "on") && count == 2) {
    ring_.setPower(node(last), verb == "on");
  } else if (verb == "reset" && count == 2) {
    ring_.resetController(node(last));
  } else if (verb == "host" && count == 3 && (last == "stop" || last == "start")) {
    ring_.setHost(node(words[1]), last == "start");
  } else if (verb == "host" && count == 4 && words[2] == "slow") {
    ring_.board(node(words[1])).slowMs = static_cast<double>(number(last, 100'000));
  } else if (verb == "clock" && count == 3) {
    ring_.node(node(words[1])).setPpm(real(last, -10'000, 10'000));
  } else if (verb == "storage" && count == 3 && (last == "fail" || last == "ok")) {
    ring_.board(node(words[1])).storageWorks = last == "ok";
  } else {
    return false;
  }
  return true;
}

bool RingBench::commandOfProgram(const Words& words, std::string& answer) {
  const std::string &verb = words[0], &last = words.back();
  const size_t count = words.size();
  if ((verb == "send" || verb == "urgent") && count == 4) {
    const unsigned to = static_cast<unsigned>(number(words[2], RING_LAST_ADDRESS));
    if (to == ring_.spec(node(words[1])).parameters.address)
      throw UserError("node " + words[1] + " sends nothing to itself.");
    const Bytes data = bytesOf(last, TRANSPORT_MESSAGE_BYTES);
    if (data.empty()) throw UserError("a message has 1 to 2048 bytes.");
    answer = std::to_string(program(words[1]).send(to, verb == "urgent", data));
  } else if (verb == "frame" && count == 3) {
    CanHost* host = ring_.canProgram(node(words[1]));
    if (!host) throw UserError("node " + words[1] + " has no CAN programs, or its host does not run.");
    host->send(canFrame(last), nullptr);
  } else if (verb == "object" && (count == 4 || count == 5)) {
    program(words[1]).setObject(static_cast<unsigned>(number(words[2], RING_LAST_ADDRESS)),
                                static_cast<unsigned>(number(words[3], 255)),
                                count == 5 ? bytesOf(last, RING_FRAME_BYTES) : Bytes{});
  } else if (verb == "watch" && count == 4) {
    program(words[1]).watch(static_cast<unsigned>(number(words[2], RING_LAST_ADDRESS, 1)),
                            static_cast<unsigned>(number(last, 255)));
  } else if (verb == "takes" && count == 3 && (last == "all" || last == "none" || last == "refuses")) {
    program(words[1]).setTakes(last == "all"    ? RingNodeHost::Takes::all
                               : last == "none" ? RingNodeHost::Takes::none
                                                : RingNodeHost::Takes::refuses);
  } else if (verb == "conflict" && count == 3 && last == "clear") {
    program(words[1]).clearConflict();
  } else if (verb == "messages" && count == 2) {
    answer = messages(program(last)).dump();
  } else {
    return false;
  }
  return true;
}

ordered_json RingBench::messages(RingNodeHost& host) {
  constexpr size_t kMost = 100;  // in one answer
  ordered_json came = ordered_json::array(), ended = ordered_json::array();
  for (const auto& m : host.messages(kMost))
    came.push_back({{"at_us", m.at / kUs},
                    {"source", m.source},
                    {"pipe", m.pipe},
                    {"number", m.number},
                    {"to_all", m.toAll},
                    {"urgent", m.urgent},
                    {"repeat", m.repeat},
                    {"data", digits(m.data)}});
  for (const auto& e : host.ends())
    ended.push_back({{"tag", e.tag}, {"outcome", nameOf(e.outcome)}, {"unconfirmed", e.unconfirmed}});
  return {{"came", came}, {"ended", ended}};
}

ordered_json RingBench::statusOf(size_t i) {
  ordered_json s = {{"node", i + 1},
                    {"address", ring_.spec(i).parameters.address},
                    {"host", ring_.spec(i).program},
                    {"powered", ring_.powered(i)},
                    {"runs", ring_.node(i).host() != nullptr}};
  if (const RingNodeHost* host = ring_.program(i)) {
    const ring_node& n = host->state();
    s["fault"] = nameOf(n.fault);
    s["life"] = n.began ? n.transport.config.life : 0;
    s["link_life"] = n.link_life;
    s["starts"] = n.starts;
    s["state"] = n.status[0];
    s["ports"] = n.status[1];
    s["members"] = host->members();
    s["received"] = host->received();
    ordered_json values = ordered_json::array();
    for (const auto& v : host->values())
      values.push_back(
          {{"source", v.source}, {"object", v.number}, {"old", v.old}, {"data", digits(v.data)}});
    s["values"] = values;
  } else if (const RingServerHost* gateway = ring_.serverProgram(i)) {
    s.update(statusOfGateway(gateway->state()));
  } else if (const RingGatewayHost* gateway = ring_.gatewayProgram(i)) {
    const struct gateway& g = gateway->state();
    s["fault"] = nameOf(g.node.fault);
    s["starts"] = g.node.starts;
    s["state"] = g.node.status[0];
    s["ports"] = g.node.status[1];
    s["slave_state"] = g.device.slave.state;
    s["outputs_valid"] = g.valid;
  } else if (const CanHost* can = ring_.canProgram(i)) {
    s["state"] = can->ringState();
    s["ports"] = can->ringPorts();
    s["backlog"] = can->backlog();
    s["overruns"] = can->overruns();
    s["failed"] = can->failed();
  }
  return s;
}

ordered_json RingBench::statusOfGateway(const ring_server& g) {
  const ring_reports& r = g.reports;
  std::vector<unsigned> present;
  for (unsigned a = 0; a < TRANSPORT_NODES; ++a)
    if (g.picture.present[a / 8] >> a % 8 & 1) present.push_back(a);
  return {{"fault", nameOf(g.node.fault)},
          {"life", g.node.life},
          {"starts", g.node.starts},
          {"state", g.node.status[0]},
          {"ports", g.node.status[1]},
          {"members", present},
          {"break", {g.picture.ends[0], g.picture.ends[1]}},
          {"reports", r.counter},
          {"stored", r.oldest},
          {"waiting", r.count},
          {"refused", r.refused},
          {"silent", !g.began || ring_reports_silent(&r, g.node.now_us)},
          {"from_node", ring_.plant()->fromNode()},
          {"to_node", ring_.plant()->toNode()}};
}

ordered_json RingBench::status() {
  ordered_json nodes = ordered_json::array(), fibres = ordered_json::array();
  for (size_t i = 0; i < ring_.size(); ++i) nodes.push_back(statusOf(i));
  const auto one = [](const Fibre& f) -> ordered_json {
    return {{"whole", f.whole()},
            {"stuck", nameOf(f.stuck())},
            {"bits_wrong", f.bitsWrong()},
            {"pulses_lost", f.pulsesLost()}};
  };
  for (size_t i = 0; i < ring_.fibres(); ++i)
    fibres.push_back({{"fibre", i + 1}, {"there", one(ring_.there(i))}, {"back", one(ring_.back(i))}});
  return {{"time_us", static_cast<double>(ring_.now() / kNs) / 1000},
          {"nodes", nodes},
          {"fibres", fibres},
          {"doors", doors_.status()}};
}

std::string RingBench::command(const Words& words) {
  std::string answer;
  if (!words.empty()) {
    if (words[0] == "status" && words.size() == 1) return status().dump();
    if (words[0] == "time" && words.size() == 1) return std::to_string(ring_.now() / kNs) + " ns";
    if (commandOfFibre(words) || commandOfNode(words) || commandOfProgram(words, answer)) return answer;
  }
  throw UserError(
      "known: cut FIBRE [there|back], mend FIBRE [there|back], stuck FIBRE there|back|both "
      "no|dark|light|dominant|recessive, pair NAME dominant|free, optics FIBRE|all errors|missing|extra N, "
      "optics FIBRE|all jitter|duty|attenuation X, off NODE, on NODE, reset NODE, host NODE stop|start|slow "
      "MS, "
      "clock NODE PPM, storage NODE fail|ok, send NODE ADDRESS HEX, urgent NODE ADDRESS HEX, "
      "frame NODE ID#HEX, object NODE ADDRESS NUMBER [HEX], watch NODE ADDRESS NUMBER, takes NODE "
      "all|none|refuses, "
      "conflict NODE clear, messages NODE, status, time, quit; the first node is 1, as is the fibre behind "
      "it.");
}
