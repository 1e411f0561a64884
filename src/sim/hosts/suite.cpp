#include "hosts/suite.h"

#include <fstream>
#include <regex>
#include <sstream>

#include "core/user_error.h"
#include "esc.h"

extern "C" {
#include "driver/controller.h"
#include "driver/mailbox.h"
#include "driver/registers.h"

void board_read(board* board, uint16_t address, uint8_t* data, uint16_t length) {
  board->host.read(address, data, length);
}
void board_write(board* board, uint16_t address, const uint8_t* data, uint16_t length) {
  board->host.write(address, data, length);
}
}

namespace hosts {
namespace {

constexpr int kLooks = 100000;  // at something that must come

void check(bool right, const std::string& what) {
  if (!right) throw Wrong(what);
}

// Registers whose content changes by itself or by what is done here, or whose write does something.
bool isLively(unsigned address) {
  return (address >= ESC_AL_CONTROL && address < ESC_PDI_CONTROL) ||
         (address >= ESC_ECAT_EVENT_REQUEST && address < ESC_USER_RAM) || address == ESC_RESET_PDI ||
         (address >= ESC_DL_STATUS && address < ESC_DL_STATUS + 2);
}

}  // namespace

std::vector<RegisterRow> registersOf(const std::string& header) {
  std::ifstream file(header);
  if (!file) throw UserError("cannot read " + header + ".");
  const std::regex row(R"(#define ESC_(\w+)\s+0x([0-9A-F]{4})u /\* .*, (\d+) byte\(s\), host: (rw?) \*/)");
  std::vector<RegisterRow> rows;
  std::smatch m;
  for (std::string line; std::getline(file, line);)
    if (std::regex_match(line, m, row))
      rows.push_back({m[1], static_cast<unsigned>(std::stoul(m[2], nullptr, 16)),
                      static_cast<unsigned>(std::stoul(m[3])), m[4] == "rw"});
  if (rows.empty()) throw UserError(header + " has no registers.");
  return rows;
}

Suite::Suite(Core& core, Host& host, Master& master, Random& random)
    : core_(core),
      host_(host),
      master_(master),
      random_(random),
      board_{host},
      byWrite_(acknowledges_by_write(&board_)) {}

void Suite::run(const std::vector<RegisterRow>& registers, int rounds) {
  if (host_.counts()) master_.write(ESC_PDI_ERROR, 0, 1);
  check(byWrite_ == core_.parameter("acknowledgeByWrite"),
        "acknowledge by write is not as in the parameters");
  identity();
  walk(registers);
  memory(rounds);
  events();
  switchOn();
  master_.run(true);
  walk(registers);
  memory(rounds);
  mailbox(rounds);
  processData(rounds);
  master_.run(false);
  quiet();
}

// A host that does what it may is never counted.
void Suite::quiet() {
  if (!host_.counts()) return;
  check(read_number(&board_, ESC_PDI_ERROR, 1) == 0,
        "an access without an error was counted: code " +
            std::to_string(read_number(&board_, ESC_PDI_ERROR_CODE, 2)));
}

void Suite::identity() {
  const auto is = [&](uint16_t address, uint8_t bytes, int value) {
    check(read_number(&board_, address, bytes) == static_cast<uint32_t>(value),
          "register " + std::to_string(address) + " is not as in the parameters");
  };
  is(ESC_ESC_TYPE, 1, core_.parameter("escType"));
  is(ESC_ESC_REVISION, 1, core_.parameter("escRevision"));
  is(ESC_ESC_BUILD, 2, core_.parameter("escBuild"));
  is(ESC_FMMUS_SUPPORTED, 1, core_.parameter("fmmus"));
  is(ESC_SYNC_MANAGERS_SUPPORTED, 1, core_.parameter("syncManagers"));
  is(ESC_RAM_SIZE, 1, core_.parameter("ramKiB"));
}

// What the host may write holds what was written, what it may only read does not; at once and byte by byte.
void Suite::walk(const std::vector<RegisterRow>& registers) {
  for (const RegisterRow& row : registers) {
    if (isLively(row.address)) continue;
    const auto address = static_cast<uint16_t>(row.address);
    Bytes before(row.bytes), after(row.bytes), pattern(row.bytes);
    host_.read(address, before.data(), row.bytes);
    for (uint8_t& b : pattern) b = random_.byte();
    host_.write(address, pattern.data(), row.bytes);
    for (unsigned i = 0; i < row.bytes; ++i)
      after[i] = static_cast<uint8_t>(read_number(&board_, static_cast<uint16_t>(address + i), 1));
    if (!row.writable) check(before == after, row.name + " has changed by a write of the host");
    else if (row.address == ESC_STATION_ALIAS) check(after == pattern, row.name + " does not hold a number");
  }
  check(number_holds(&board_, ESC_STATION_ALIAS, 2, 0x5aa5), "the station alias does not hold a number");
  check(number_holds(&board_, ESC_AL_EVENT_MASK, 4, 0x00000f11), "the event mask does not hold a number");
  events_select(&board_, 0);
  quiet();
}

void Suite::memory(int rounds) {
  check(memory_holds(&board_, ESC_USER_RAM, 128), "the user RAM does not hold patterns");
  check(memory_holds(&board_, place::kHost, 64), "the RAM does not hold patterns");
  Bytes shadow(place::kHostBytes, 0), bytes;
  host_.write(place::kHost, shadow.data(), place::kHostBytes);
  for (int i = 0; i < 4 * rounds; ++i) {
    const unsigned length = 1 + random_.below(random_.once(8) ? 64 : 8);
    const unsigned at = random_.below(place::kHostBytes - length + 1);
    bytes.resize(length);
    if (random_.once(2)) {
      for (uint8_t& b : bytes) b = random_.byte();
      host_.write(place::kHost + at, bytes.data(), length);
      std::copy(bytes.begin(), bytes.end(), shadow.begin() + at);
    } else {
      host_.read(place::kHost + at, bytes.data(), length);
      check(std::equal(bytes.begin(), bytes.end(), shadow.begin() + at),
            "the RAM has other bytes than were written at offset " + std::to_string(at));
    }
  }
  bytes.resize(place::kHostBytes);
  host_.read(place::kHost, bytes.data(), place::kHostBytes);
  check(bytes == shadow, "the RAM has other bytes than were written");
  quiet();
}

// AL control: event, mask, interrupt, acknowledge, answer.
void Suite::events() {
  check(!host_.irq(), "an interrupt without an event");
  for (int masked = 0; masked < 2; ++masked) {
    events_select(&board_, masked ? uint32_t{EVENT_SYNC0 | EVENT_WATCHDOG} : uint32_t{EVENT_AL_CONTROL});
    const uint16_t state = masked ? AL_INIT : AL_PREOP;
    master_.write(ESC_AL_CONTROL, state, 2);
    check(host_.irq() == !masked, "the interrupt does not follow event and mask");
    check((events_pending(&board_) & EVENT_AL_CONTROL) != 0, "no event of AL control");
    if (host_.eventsSeen() >= 0)
      check((host_.eventsSeen() & 0xffff) == (events_pending(&board_) & 0xffff) || host_.eventsSeen() == 0,
            "the bytes beside an address are not the events");
    check(al_control(&board_, byWrite_) == state, "AL control is not what the master has written");
    core_.cycle(8);
    check(!host_.irq() && !(events_pending(&board_) & EVENT_AL_CONTROL), "the event of AL control stays");
    al_answer(&board_, state, static_cast<uint16_t>(0x8000 + masked));
    check(al_status(&board_) == state, "AL status is not what the host has written");
    const Datagram status = master_.pass({false, ESC_AL_STATUS, Bytes(6)});
    check(
        status.counter == 1 && status.data[0] == state && status.data[5] == 0x80 && status.data[4] == masked,
        "the master reads another AL status");
  }
  quiet();
}

void Suite::switchOn() {
  if (sync_manager_control(&board_, 0)) return;
  const auto manager = [&](unsigned n, unsigned start, unsigned length, unsigned control) {
    master_.write(ESC_SMN_START(n), start | length << 16 | uint64_t{control} << 32 | uint64_t{1} << 48, 8);
    struct sync_manager settings;
    sync_manager_read(&board_, static_cast<uint8_t>(n), &settings);
    check(settings.start == start && settings.length == length && settings.control == control &&
              (settings.activate & SM_ENABLED),
          "a SyncManager is not as the master has set it");
    check(sync_manager_is_on(&board_, static_cast<uint8_t>(n)), "a SyncManager is off");
  };
  manager(MAILBOX_RECEIVE, place::kMailboxIn, place::kMailbox, 0x26);
  manager(MAILBOX_SEND, place::kMailboxOut, place::kMailbox, 0x22);
  manager(2, place::kOutputs, place::kProcess, 0x24);
  manager(3, place::kInputs, place::kProcess, 0x20);
  uint8_t bytes[4];
  activations_read(&board_, bytes, 4, byWrite_);
  check(!(events_pending(&board_) & EVENT_ACTIVATION), "the event of the activation stays");
}

// Every message of the master arrives once and whole, and every one to it.
void Suite::mailbox(int rounds) {
  const mailbox_area in{place::kMailboxIn, place::kMailbox}, out{place::kMailboxOut, place::kMailbox};
  int64_t taken = master_.lastPosted(), put = master_.lastFetched();
  const int64_t until = taken + rounds;
  events_select(&board_, event_of(MAILBOX_RECEIVE));
  master_.post(rounds);
  for (int looks = 0; taken < until || put < until; ++looks) {
    check(looks < kLooks, "no message passes any more");
    if (taken < until &&
        (random_.once(2) ? host_.irq() : (events_pending(&board_) & event_of(MAILBOX_RECEIVE)) != 0)) {
      check(mailbox_is_full(&board_, MAILBOX_RECEIVE), "an event without a message");
      Bytes message(place::kMailbox);
      mailbox_take(&board_, &in, message.data(), byWrite_);
      check(messageNumberOf(message) == ++taken, "the host has read a torn, lost or doubled message");
    }
    if (put < until && !mailbox_is_full(&board_, MAILBOX_SEND)) {
      mailbox_put(&board_, &out, messageOf(static_cast<uint32_t>(++put)).data());
    }
    core_.cycle(static_cast<int>(random_.below(20)));
  }
  for (int looks = 0; master_.lastFetched() < put; ++looks) {
    check(looks < kLooks, "the last message is not fetched");
    core_.cycle(10);
  }
  events_select(&board_, 0);
  quiet();
}

// Buffers of three: whole, and never an older one.
void Suite::processData(int rounds) {
  int64_t outputs = 0, inputs = master_.lastInputs();
  for (int i = 0; i < rounds; ++i) {
    const int64_t before = master_.lastOutputs();
    Bytes buffer(place::kProcess);
    if (before > 0) {
      buffer_read(&board_, place::kOutputs, buffer.data(), place::kProcess, byWrite_);
      const int64_t number = numberOf(buffer);
      check(number >= 0, "the host has read a torn buffer");
      check(number >= outputs && number >= before, "the host has read an older buffer");
      outputs = number;
    }
    buffer = stamped(static_cast<uint32_t>(++inputs), place::kProcess);
    host_.write(place::kInputs, buffer.data(), place::kProcess);
    core_.cycle(static_cast<int>(random_.below(400)));
    check(master_.lastInputs() <= inputs, "the master has read what the host has not written");
  }
  for (int looks = 0; master_.lastInputs() < inputs; ++looks) {
    check(looks < kLooks, "the last buffer is not read");
    core_.cycle(10);
  }
  check(master_.lastOutputs() > 0, "the master has written no buffer");
  quiet();
}

}  // namespace hosts
