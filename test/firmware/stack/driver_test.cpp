// The driver alone, on a fake controller.
#include <map>

#include "bench.h"

namespace {
// Notes the order of accesses.
struct Noting : board {
  std::vector<uint16_t> read;
  uint8_t readByte(uint16_t a) override {
    read.push_back(a);
    return board::readByte(a);
  }
};

void numbers() {
  Noting b;
  write_number(&b, 0x0f80, 4, 0x12345678);
  check("ST-48: numbers are little endian, bytes ascend",
        b.writes ==
                std::vector<std::pair<uint16_t, uint8_t>>{
                    {0x0f80, 0x78}, {0x0f81, 0x56}, {0x0f82, 0x34}, {0x0f83, 0x12}} &&
            read_number(&b, 0x0f80, 3) == 0x345678 &&
            b.read == std::vector<uint16_t>{0x0f80, 0x0f81, 0x0f82});
  check("ST-48: a memory that holds is told from one that does not", [&] {
    const bool good = memory_holds(&b, 0x0f80, 128);
    b.stuck[0x0f90] = 4;
    return good && !memory_holds(&b, 0x0f80, 128) && !number_holds(&b, 0x0f90, 2, 4) &&
           number_holds(&b, 0x0f90, 2, 3);
  }());
}

void controller() {
  Controller c;
  const bool byWrite = acknowledges_by_write(&c);
  check("SM-38: the driver sees how it is acknowledged", byWrite == Controller::newByWrite);
  c.control(0x12);
  check("ST-48: AL control is read, and its event ends",
        events_pending(&c) == EVENT_AL_CONTROL && al_control(&c, byWrite) == 0x12 && events_pending(&c) == 0);
  al_answer(&c, 0x14, 0x001b);
  check("ST-48: AL status and code are told", al_status(&c) == 0x14 && c.code() == 0x001b);
  c.setSyncManager(5, 0x1234, 0x0102, 0x64);
  sync_manager sm{};
  sync_manager_read(&c, 5, &sm);
  check("ST-48: settings of a SyncManager", sm.start == 0x1234 && sm.length == 0x0102 && sm.control == 0x64 &&
                                                sm.activate == 1 && sm.status == 0x30);
  uint8_t activations[8];
  c.setActivate(5, 3);
  const bool before = events_pending(&c) & EVENT_ACTIVATION;
  activations_read(&c, activations, 8, byWrite);
  check("ST-48: activations are read, and their event ends",
        before && activations[5] == 3 && activations[4] == 0 && !(events_pending(&c) & EVENT_ACTIVATION));
  c.memory[0x082f] = 0x42;
  sync_manager_switch(&c, 5, false);
  const bool off = c.memory[0x082f] == 0x43;
  sync_manager_switch(&c, 5, true);
  check("ST-48: the host's switch leaves the other bits", off && c.memory[0x082f] == 0x42);
  c.write(5, Bytes(0x0102, 7));
  const bool ran = watchdog_runs(&c, byWrite);
  c.expireWatchdog();
  check("ST-48: the watchdog", ran && (events_pending(&c) & EVENT_WATCHDOG) && !watchdog_runs(&c, byWrite) &&
                                   !(events_pending(&c) & EVENT_WATCHDOG));
  c.setSync0(true, 1000000);
  c.sync0();
  const bool sync = sync0_is_active(&c) && sync0_cycle(&c) == 1000000 && (events_pending(&c) & EVENT_SYNC0);
  sync0_acknowledge(&c, byWrite);
  check("ST-48: SYNC0", sync && !(events_pending(&c) & EVENT_SYNC0));
  c.memory[0x0981] = 1;
  check("ST-48: cyclic operation without SYNC0 is none", !sync0_is_active(&c));
}

void mailbox() {
  Controller c;
  c.setSyncManager(0, 0x1000, 64, 0x26);
  c.setSyncManager(1, 0x1080, 64, 0x22);
  Bytes message(64);
  for (size_t i = 0; i < 64; ++i) message[i] = static_cast<uint8_t>(i * 5);
  const mailbox_area in{0x1000, 64}, out{0x1080, 64};
  const bool empty = !mailbox_is_full(&c, MAILBOX_RECEIVE);
  c.write(0, message);
  const bool full = mailbox_is_full(&c, MAILBOX_RECEIVE);
  Bytes taken(64);
  mailbox_take(&c, &in, taken.data(), acknowledges_by_write(&c));
  check("ST-48: a message is taken whole, and the mailbox is empty",
        empty && full && taken == message && !mailbox_is_full(&c, MAILBOX_RECEIVE));
  const mailbox_header header{5, 0x1001, 0x40, MAILBOX_COE, 6};
  Bytes sent(64, 0xee);
  mailbox_header_write(sent.data(), &header);
  check("ST-48: a header", Bytes(sent.begin(), sent.begin() + 6) == Bytes({5, 0, 1, 0x10, 0x40, 0x63}));
  mailbox_put(&c, &out, sent.data());
  Bytes got;
  check("ST-48: a short message fills the mailbox",
        c.read(1, got) && Bytes(got.begin(), got.begin() + 11) == Bytes(sent.begin(), sent.begin() + 11));
  const mailbox_header longest{58, 0, 0, MAILBOX_COE, 1};
  mailbox_header_write(sent.data(), &longest);
  mailbox_put(&c, &out, sent.data());
  check("ST-48: and so does the longest", c.read(1, got) && got == sent && got[63] == 0xee);
  c.setActivate(1, 3);
  const bool asked = mailbox_repeat_asked(&c);
  mailbox_repeated(&c);
  check("ST-48: a repetition is asked for and acknowledged",
        asked && !mailbox_repeat_asked(&c) && c.repeatAcknowledged(1));
}
}  // namespace

void testDriver() {
  numbers();
  controller();
  mailbox();
}
