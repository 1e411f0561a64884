#include "ring/slcan.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "core/user_error.h"
#include "ring-node.h"

namespace {
constexpr size_t kLongest = 32;      // characters of a command
constexpr size_t kUnread = 1 << 20;  // that wait for a program
constexpr unsigned kPatience = 50'000;  // looks of main.cpp without a place at the port: a second
constexpr const char* kGood = "\r";
constexpr const char* kBad = "\a";
constexpr unsigned kMinuteMs = 60'000;  // time stamps begin anew
constexpr uint32_t kWarning = 96;       // of an error counter

bool isHex(const std::string& text) {
  return text.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
}

// Where a link leads; empty: it is none.
std::string linked(const std::string& path) {
  std::error_code none;
  return std::filesystem::read_symlink(path, none).string();
}

// Terminals are there as long as a program has them.
void removeOldLink(const std::string& path) {
  struct stat there;
  if (lstat(path.c_str(), &there) < 0) return;
  if (!S_ISLNK(there.st_mode)) throw UserError("'" + path + "' is there already and is no link.");
  if (linked(path).rfind("/dev/pts/", 0) != 0)
    throw UserError("'" + path + "' is there already and is no link to a pseudo-terminal.");
  if (stat(path.c_str(), &there) == 0)
    throw UserError("another program has the terminal '" + path + "'; remove the link if it is an old one.");
  unlink(path.c_str());
}
}  // namespace

SlcanDoor::SlcanDoor(const std::string& path) : path_(path) {
  removeOldLink(path);  // first: the new terminal may have the name of an old one
  terminal_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  char name[128];
  if (terminal_ < 0 || grantpt(terminal_) < 0 || unlockpt(terminal_) < 0 ||
      ptsname_r(terminal_, name, sizeof name) != 0)
    throw UserError(std::string("there is no pseudo-terminal: ") + std::strerror(errno) + ".");
  const int programs = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (programs < 0 || tcgetattr(programs, &raw_) < 0)
    throw UserError("the pseudo-terminal '" + std::string(name) + "' cannot be opened.");
  cfmakeraw(&raw_);
  tcsetattr(programs, TCSANOW, &raw_);
  close(programs);
  terminalName_ = name;
  if (symlink(name, path.c_str()) < 0)
    throw UserError("cannot make the link '" + path + "': " + std::strerror(errno) + ".");
}

SlcanDoor::~SlcanDoor() {
  if (linked(path_) == terminalName_) unlink(path_.c_str());
  close(terminal_);
}

void SlcanDoor::say(const std::string& text) {
  if (out_.size() + text.size() > kUnread) {
    ++dropped_;
    overrun_ = true;
    return;
  }
  out_ += text;
  flush();
}

void SlcanDoor::flush() {
  if (out_.empty()) return;
  const ssize_t n = write(terminal_, out_.data(), out_.size());
  if (n > 0) out_.erase(0, static_cast<size_t>(n));
}

void SlcanDoor::serve(CanHost* port) {
  pollfd there{terminal_, 0, 0};
  poll(&there, 1, 0);
  if ((there.revents & POLLHUP) == 0) {
    used_ = true;
    // Only so much at a time: a program that never ends would stop the simulation.
    for (int left = 8; left > 0 && take(port) && hear(); --left) {}
    flush();
  } else if (used_) {
    // What it has said is still to be carried out.
    used_ = false;
    while (take(port) && hear()) {}
    leave();
  }
}

// More of what a program has written; false: there is nothing more.
bool SlcanDoor::hear() {
  char buffer[512];
  const ssize_t n = read(terminal_, buffer, sizeof buffer);
  if (n > 0) unread_.assign(buffer, static_cast<size_t>(n));
  return n > 0;
}

// No program has the terminal any more: the next one finds it as the first has, and nothing of the last one's
// answers.
void SlcanDoor::leave() {
  open_ = listenOnly_ = stamps_ = tooLong_ = overrun_ = busError_ = false;
  waited_ = 0;
  in_.clear();
  out_.clear();
  programs_.push_back(0);
  tcflush(terminal_, TCOFLUSH);
  const int programs = open(terminalName_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
  tcflush(programs, TCIFLUSH);
  tcsetattr(programs, TCSANOW, &raw_);
  close(programs);
}

// A frame waits for a place at the port, and all behind it with it, as at an adapter that stops the line; but
// not for ever, as orders wait, too, and not for a program that has left.
bool SlcanDoor::waits(CanHost* port) {
  if (!port || port->backlog() < kBacklog) waited_ = 0;
  else if (used_ && waited_ < kPatience && frameOf(in_)) return ++waited_;
  return false;
}

// Carries out what has been heard; false: something of it waits.
bool SlcanDoor::take(CanHost* port) {
  for (size_t i = 0; i < unread_.size(); ++i) {
    const char c = unread_[i];
    if (c == '\r') {
      if (waits(port)) {
        unread_.erase(0, i);
        return false;
      }
      const uint64_t dropped = dropped_;
      const std::string reply = tooLong_ ? kBad : answer(in_, port);
      if (reply == kBad && dropped_ == dropped) ++malformed_;
      say(reply);
      in_.clear();
      tooLong_ = false;
    } else if (c != '\n') {
      tooLong_ = tooLong_ || in_.size() >= kLongest;
      if (!tooLong_) in_ += c;
    }
  }
  unread_.clear();
  return true;
}

// Frames with 3 or 8 digits of identifier, DLC, and two digits for each byte.
std::optional<CanFrame> SlcanDoor::frameOf(const std::string& command) const {
  CanFrame f;
  f.extended = command[0] == 'T' || command[0] == 'R';
  f.remote = command[0] == 'r' || command[0] == 'R';
  const bool is = f.extended || f.remote || command[0] == 't';
  const size_t digits = f.extended ? 8 : 3;
  if (!is || !open_ || listenOnly_ || tooLong_ || command.size() < digits + 2 || !isHex(command.substr(1)))
    return {};
  const unsigned long id = std::stoul(command.substr(1, digits), nullptr, 16);
  const char dlc = command[digits + 1];
  if (id > (f.extended ? 0x1fffffffu : 0x7ffu) || dlc < '0' || dlc > '8') return {};
  f.id = static_cast<uint32_t>(id);
  f.dlc = static_cast<uint8_t>(dlc - '0');
  if (command.size() != digits + 2 + 2 * f.bytes()) return {};
  for (size_t i = 0; i < f.bytes(); ++i)
    f.data[i] = static_cast<uint8_t>(std::stoul(command.substr(digits + 2 + 2 * i, 2), nullptr, 16));
  return f;
}

std::string SlcanDoor::send(const std::string& command, CanHost* port) {
  const auto frame = frameOf(command);
  if (!frame) return kBad;
  if (port && port->backlog() >= kBacklog) {
    ++dropped_;
    return kBad;
  }
  if (port) port->send(*frame, program());
  else ++dropped_;
  return frame->extended ? "Z\r" : "z\r";
}

// What has happened since the last time, and how the controller is.
std::string SlcanDoor::flags(const CanHost* port) {
  unsigned bits = 0;
  if (port) {
    const CanFault& s = port->state();
    if (port->backlog() >= kBacklog) bits |= 0x02;
    if (s.tec >= kWarning || s.rec >= kWarning) bits |= 0x04;
    if (s.state == NODE_CAN_STATE_PASSIVE || s.state == NODE_CAN_STATE_BUS_OFF) bits |= 0x20;
  }
  if (overrun_) bits |= 0x08;
  if (busError_) bits |= 0x80;
  overrun_ = busError_ = false;
  char text[8];
  std::snprintf(text, sizeof text, "F%02X\r", bits);
  return text;
}

std::string SlcanDoor::answer(const std::string& command, CanHost* port) {
  if (command.empty()) return kGood;
  const bool alone = command.size() == 1;
  switch (command[0]) {
    // The bit rate is the ring's: one that adapters have is taken, and changes nothing.
    case 'S': return !open_ && command.size() == 2 && command[1] >= '0' && command[1] <= '8' ? kGood : kBad;
    case 's':
      return !open_ && (command.size() == 5 || command.size() == 7) && isHex(command.substr(1)) ? kGood
                                                                                                : kBad;
    case 'O':
    case 'L':
      if (!alone || open_) return kBad;
      open_ = true;
      listenOnly_ = command[0] == 'L';
      return kGood;
    case 'C':
      if (!alone) return kBad;
      open_ = false;
      return kGood;
    case 't':
    case 'r':
    case 'T':
    case 'R': return send(command, port);
    case 'V': return alone ? "V1010\r" : kBad;
    case 'N': return alone ? "N0000\r" : kBad;
    case 'F': return alone && open_ ? flags(port) : kBad;
    case 'Z':
      if (open_ || command.size() != 2 || (command[1] != '0' && command[1] != '1')) return kBad;
      stamps_ = command[1] == '1';
      return kGood;
    default: return kBad;
  }
}

void SlcanDoor::happened(const CanEvent& e) {
  if (e.kind == CanEvent::fault && e.error.type != NODE_CAN_ERROR_NONE) busError_ = true;
  const bool isFrame = e.kind == CanEvent::received || (e.kind == CanEvent::sent && e.by != program());
  if (!open_ || !isFrame) return;
  const CanFrame& f = e.frame;
  char text[16];
  std::string line(1, f.extended ? (f.remote ? 'R' : 'T') : (f.remote ? 'r' : 't'));
  std::snprintf(text, sizeof text, f.extended ? "%08X%u" : "%03X%u", f.id, f.dlc > 8u ? 8u : f.dlc);
  line += text;
  for (size_t i = 0; i < f.bytes(); ++i) std::snprintf(text, sizeof text, "%02X", f.data[i]), line += text;
  if (stamps_) {
    std::snprintf(text, sizeof text, "%04X", static_cast<unsigned>(e.at / (1000 * kUs) % kMinuteMs));
    line += text;
  }
  say(line + kGood);
}
