#include "ring/socketcand.h"

#include <sstream>
#include <vector>

#include "ring/socketcan.h"

namespace {
constexpr size_t kLongest = 256;  // characters of a line
constexpr const char* kOk = "< ok >";

bool parseHex(const std::string& text, size_t most, uint32_t& value) {
  if (text.empty() || text.size() > most ||
      text.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos)
    return false;
  value = static_cast<uint32_t>(std::stoul(text, nullptr, 16));
  return true;
}

std::string verbOf(const std::string& words) {
  std::string verb;
  std::istringstream(words) >> verb;
  return verb;
}
}  // namespace

// send ID DLC BYTES: 3 digits of an identifier of 11 bits, 8 of one of 29.
bool SocketcandDoor::send(Client& c, const std::string& words, CanHost* port) {
  std::istringstream line(words);
  std::string verb, id, dlc, byte;
  line >> verb >> id >> dlc;
  uint32_t number, length, value;
  if (!parseHex(id, 8, number) || !parseHex(dlc, 1, length) || length > 8) return false;
  std::vector<uint8_t> data;
  while (line >> byte) {
    if (!parseHex(byte, 2, value)) return false;
    data.push_back(static_cast<uint8_t>(value));
  }
  if (data.size() != length) return false;
  const bool extended = id.size() == 8;
  if (extended && number > 0x1fffffff) return false;
  const auto frame = socketcan::canFrame(number | (extended ? socketcan::kExtended : 0), length, data.data());
  if (!frame) return false;
  if (!port) ++dropped_;
  else port->send(*frame, sender(c));
  return true;
}

std::string SocketcandDoor::answer(Client& c, const std::string& words, CanHost* port) {
  std::istringstream line(words);
  std::string verb, argument, more;
  line >> verb >> argument >> more;
  if (verb == "send" && c.open) {
    // As the real one: programs would take an answer for an error frame.
    if (!send(c, words, port)) ++malformed_;
    return "";
  }
  if (verb == "echo" && argument.empty()) return "< echo >";
  if (verb == "open" && !argument.empty() && more.empty() && !c.open) {
    if (argument != kBus) return std::string("< error the bus is ") + kBus + " >";
    c.open = true;
    return kOk;
  }
  if (verb == "rawmode" && argument.empty() && c.open) {
    c.raw = true;
    return kOk;
  }
  ++malformed_;
  return c.open ? "< error unknown command >" : "< error no bus is open >";
}

void SocketcandDoor::take(Client& c, CanHost* port) {
  for (size_t end; (end = c.in.find('>')) != std::string::npos;) {
    const size_t begin = c.in.rfind('<', end);
    const std::string words =
        begin == std::string::npos || end - begin > kLongest ? "" : c.in.substr(begin + 1, end - begin - 1);
    if (port && port->backlog() >= kBacklog && c.open && verbOf(words) == "send") break;
    c.in.erase(0, end + 1);
    const std::string reply = answer(c, words, port);
    if (!reply.empty()) say(c, reply);
  }
  if (c.in.size() > kLongest && c.in.find('>') == std::string::npos) {
    ++malformed_;
    c.in.clear();
  }
}

void SocketcandDoor::happened(const CanEvent& e) {
  const auto frame = socketcan::of(e);
  if (!frame || (frame->id & socketcan::kRemote)) return;  // the protocol has no remote frames
  const bool isError = frame->id & socketcan::kError;
  char text[96];
  const Time us = e.at / kUs;
  std::snprintf(
      text, sizeof text,
      isError || (frame->id & socketcan::kExtended) ? "< %s %08X %lld.%06lld" : "< %s %03X %lld.%06lld",
      isError ? "error" : "frame", isError ? frame->id : frame->id & 0x1fffffff,
      static_cast<long long>(us / 1'000'000), static_cast<long long>(us % 1'000'000));
  std::string line = text;
  line += " ";
  if (!isError) {
    for (size_t i = 0; i < frame->length; ++i)
      std::snprintf(text, sizeof text, "%02X", frame->data[i]), line += text;
    line += " ";
  }
  line += ">";
  for (Client& c : clients_)
    if (c.raw && e.by != sender(c)) say(c, line);
}
