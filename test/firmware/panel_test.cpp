// What the display of a master shows.
#include "master_fake.h"

namespace {
constexpr uint32_t kFire = PROTOCOL_MASTER_FIRE | PROTOCOL_MASTER_ALARM,
                   kLoud = kFire | PROTOCOL_MASTER_SOUNDING;
constexpr uint16_t kAlarm = PROTOCOL_SLAVE_ALARM | PROTOCOL_SLAVE_LATCHED;

struct Shown : StartedMaster {
  explicit Shown(uint8_t lines = 4, uint8_t columns = 20, unsigned nodes = 5)
      : StartedMaster(nodes, [&](auto& p) { p.panel.lines = lines, p.panel.columns = columns; }) {}
  void alarm(size_t slave, uint32_t state = kLoud) {
    c.slaves[slave].status |= kAlarm;
    c.setState(state);
    pass(200);
  }
  bool shows(const std::vector<std::string>& texts) {
    for (size_t i = 0; i < texts.size(); ++i)
      if (c.display[i] != texts[i]) {
        for (const auto& l : c.display) std::printf("      '%s'\n", l.c_str());
        return false;
      }
    return true;
  }
  // All different texts of a line within some pages.
  std::vector<std::string> pages(int number, unsigned count) {
    std::vector<std::string> all;
    for (unsigned i = 0; i < 20 * count; ++i) {
      pass(100);
      bool known = false;
      for (const auto& t : all) known = known || t == line(number);
      if (!known) all.push_back(line(number));
    }
    return all;
  }
};

void quiet() {
  Shown s;
  s.pass(200);
  check("PANEL-03: nothing is wrong", s.shows({"No alarm, no fault  ", "5 slaves            ",
                                               "                    ", "                    "}));
  const unsigned displayed = s.c.displayed;
  s.pass(5000);
  check("a line is written only when it is another one", s.c.displayed == displayed);
  Shown wide(2, 40);
  wide.pass(200);
  check("lines are as long as the display is wide",
        wide.line(0).size() == 40 && wide.line(1).size() == 40 && wide.line(2).empty());
}

void alarms() {
  Shown s;
  s.alarm(3);
  check("PANEL-04: an alarm: who, where, since when",
        s.shows({"FIRE 1              ", "1 2B Great hal 00:00", "                    "}));
  s.pass(61'000);
  s.alarm(0);
  check("PANEL-04: the first alarm and the last one",
        s.shows({"FIRE 2              ", "1 2B Great hal 01:01", "2 1A Cellar    00:00",
                 "                    "}));
  s.alarm(4), s.alarm(2);
  check("PANEL-04: the last one is another one now", s.line(2) == "4 2A Kitchen   00:00");
  const auto further = s.pages(3, 6);
  bool both = further.size() >= 2;
  for (const auto& t : further)
    both = both && (t.rfind("2 1A Cellar", 0) == 0 || t.rfind("3 3A Roof", 0) == 0);
  check("PANEL-04: the others come one after the other", both);
  s.c.setState(kFire | PROTOCOL_MASTER_SERVER_SILENT);
  s.pass(200);
  check("PANEL-04: it is said when sounders are silenced, and when there are faults, too",
        s.line(0) == "FIRE 4 silenced FLT ");
  for (auto& slave : s.c.slaves) slave.status = 0;
  s.c.setState(0);
  s.pass(200);
  check("PANEL-04: after a reset there is none", s.line(0) == "No alarm, no fault  ");
  s.alarm(1);
  check("PANEL-04: and the next one is the first", s.line(1) == "1 1B Cellar    00:00");
}

void lines() {
  Shown two(2);
  two.alarm(3), two.alarm(0), two.alarm(4);
  check("PANEL-04: two lines: the first alarm stays", two.line(0).rfind("1 2B Great", 0) == 0);
  const auto pages = two.pages(1, 6);
  bool last = false, further = false;
  for (const auto& t : pages) {
    last = last || t.rfind("3 3A Roof", 0) == 0;
    further = further || t.rfind("2 1A Cellar", 0) == 0;
  }
  check("PANEL-04: the last one and the others share the other", last && further);
  Shown three(3);
  three.alarm(3), three.alarm(0);
  check("PANEL-04: three lines",
        three.shows({"FIRE 2              ", "1 2B Great hal 00:00", "2 1A Cellar    00:00"}) &&
            three.line(3).empty());
  Shown wide(4, 40);
  wide.alarm(3);
  check("PANEL-04: forty columns",
        wide.line(1) == "1 2B Great hall behind the kitchen 00:00" && wide.line(1).size() == 40);
}

void times() {
  Shown s;
  s.alarm(0);
  const struct {
    uint32_t seconds;
    const char* text;
  } all[] = {{5'999, "99:59"}, {6'000, "01h40"}, {359'999, "99h59"}, {360'000, "> 99h"}};
  const uint64_t begin = s.host.picture.slaves[0].since_s;
  for (const auto& t : all) {
    s.c.time = (begin + t.seconds) * 1'000'000;
    s.c.setWord(MASTER_HOST_ALIVE, 4000);
    s.serve();
    s.pass(150);
    check(std::string("PANEL-04: since ") + t.text, s.line(1) == std::string("1 1A Cellar    ") + t.text);
  }
}

void unusual() {
  Shown s(4, 20, 6);
  s.alarm(5);
  check("PANEL-04: a slave that stands in no list has its node ID", s.line(1) == "1 node 6       00:00");
  Shown lost;
  lost.alarm(2);
  lost.c.slaves[2].status = PROTOCOL_SLAVE_ABSENT | PROTOCOL_SLAVE_WRONG;
  lost.pass(200);
  check("PANEL-04: a slave that has gone stays in alarm", lost.line(1).rfind("1 2A Kitchen", 0) == 0);
  lost.c.setState(0);
  lost.pass(200);
  check("PANEL-04: until the master has none",
        lost.line(0) == "FAULT 1             " && lost.line(1) == "2A Kitchen   missing");
  Shown late;
  late.c.slaves[2].status = kAlarm | PROTOCOL_SLAVE_ABSENT;
  late.c.setState(kLoud);
  late.pass(200);
  check("PANEL-04: or was in alarm before the host started", late.line(1).rfind("1 2A Kitchen", 0) == 0);
  Shown unknown;
  unknown.c.setState(kLoud);
  unknown.pass(200);
  check("PANEL-04: an alarm whose slave the host has not seen yet",
        unknown.line(0) == "FIRE place unknown  ");
  Shown many(4, 20, 128);
  for (size_t i = 0; i < 128; ++i) many.c.slaves[i].status |= kAlarm;
  many.c.setState(kLoud);
  many.pass(500);
  check("PANEL-04: all of 128 slaves", many.line(0) == "FIRE 128            " &&
                                           many.line(1).rfind("1 ", 0) == 0 &&
                                           many.line(2).rfind("128 ", 0) == 0);
}

void faults() {
  const struct {
    uint32_t bit;
    const char* text;
  } master[] = {{PROTOCOL_MASTER_LINE_DEAD, "No slave answers    "},
                {PROTOCOL_MASTER_RING_OPEN, "Ring cut before 4   "},
                {PROTOCOL_MASTER_WRONG_LINE, "Slaves not as listed"},
                {PROTOCOL_MASTER_SERVER_SILENT, "Server silent       "},
                {PROTOCOL_MASTER_HOST_DEAD, "Host was dead       "},
                {PROTOCOL_MASTER_CONFIGURATION, "Master: FPGA bad    "},
                {PROTOCOL_MASTER_MAINS, "Mains failed        "},
                {PROTOCOL_MASTER_BATTERY, "Battery low         "},
                {PROTOCOL_MASTER_EARTH, "Earth fault         "},
                {PROTOCOL_MASTER_STORAGE, "Memory failed       "},
                {PROTOCOL_MASTER_UNLISTED, "No slaves listed    "},
                {PROTOCOL_MASTER_FULL, "Server takes nothing"},
                {PROTOCOL_MASTER_PLANT_DEAD, "No plant network    "}};
  uint32_t shown = PROTOCOL_MASTER_SLAVE_FAULT;  // its slaves are shown instead
  for (const auto& m : master) {
    Shown s;
    s.c.memory[MASTER_RING_CUT] = 3;
    s.c.setState(m.bit);
    s.pass(200);
    check(std::string("PANEL-05: ") + m.text, s.shows({"FAULT 1             ", m.text}));
    shown |= m.bit;
  }
  check("PANEL-05: every fault of the master has a text", shown == PROTOCOL_MASTER_FAULTS);
  const struct {
    uint16_t bits;
    const char* text;
  } slave[] = {{PROTOCOL_SLAVE_OPEN, "2A Kitchen      open"},
               {PROTOCOL_SLAVE_SHORT, "2A Kitchen     short"},
               {PROTOCOL_SLAVE_UNWATCHED, "2A Kitchen       off"},
               {PROTOCOL_SLAVE_HOST_DEAD, "2A Kitchen host dead"},
               {PROTOCOL_SLAVE_DROPPED, "2A Kitchen   dropped"},
               {PROTOCOL_SLAVE_UNWELL, "2A Kitchen self-test"},
               {PROTOCOL_SLAVE_CONFIGURATION, "2A Kitchen  FPGA bad"},
               {PROTOCOL_SLAVE_WRONG, "2A Kitchen     wrong"},
               {PROTOCOL_SLAVE_WRONG | PROTOCOL_SLAVE_ABSENT, "2A Kitchen   missing"}};
  uint32_t ofSlaves = 0;
  for (const auto& f : slave) {
    Shown s;
    s.c.slaves[2].status = f.bits;
    s.pass(200);
    check(std::string("PANEL-05: ") + f.text, s.shows({"FAULT 1             ", f.text}));
    ofSlaves |= f.bits;
  }
  check("PANEL-05: every fault of a slave has a text",
        ofSlaves == (PROTOCOL_SLAVE_FAULTS | PROTOCOL_SLAVE_ABSENT));

  Shown never;
  never.c.slaves[2] = {PROTOCOL_SLAVE_WRONG | PROTOCOL_SLAVE_ABSENT, 0};
  never.pass(200);
  check("PANEL-05: a slave that was never seen is known by its place",
        never.line(1) == "2A Kitchen   missing");
  Shown many;
  for (auto& s : many.c.slaves) s.status = PROTOCOL_SLAVE_OPEN;
  many.c.setState(PROTOCOL_MASTER_MAINS);
  many.pass(200);
  check("PANEL-05: how many", many.line(0) == "FAULT 6             ");
  check("PANEL-05: they come page by page", many.pages(1, 6).size() == 2 && many.pages(3, 6).size() == 2);

  Shown disabled;
  disabled.c.slaves[0].status = PROTOCOL_SLAVE_DISABLED;
  disabled.c.slaves[4].status = PROTOCOL_SLAVE_TESTING | PROTOCOL_SLAVE_TEST_ALARM;
  disabled.pass(200);
  check("PANEL-06: who is disabled or tested",
        disabled.shows({"DISABLED OR TEST 2  ", "1A Cellar   disabled", "3A Roof    TEST fire"}));
  disabled.c.slaves[2].status = PROTOCOL_SLAVE_SHORT;
  disabled.pass(200);
  check("PANEL-06: behind those with a fault",
        disabled.shows({"FAULT 1             ", "2A Kitchen     short", "1A Cellar   disabled"}));
}

void test() {
  Shown s;
  s.c.inputs = BOARD_TEST;
  s.pass(200);
  const std::string all(20, '#');
  check("PANEL-02: the lamp test shows every place", s.shows({all, all, all, all}));
  s.c.inputs = 0;
  s.pass(200);
  check("PANEL-02: and ends", s.line(0) == "No alarm, no fault  ");
}

// A display gets what it can show, whatever the texts are.
void strange() {
  static const alarm_place odd[] = {{1, "T\xc3\xbcr\n", ""}, {2, "", ""}};
  Shown s;
  s.host.panel.parameters.places = odd, s.host.panel.parameters.place_count = 2;
  s.alarm(0);
  check("PANEL-03: what a display cannot show is a question mark", s.line(1) == "1 T??r?        00:00");
  s.alarm(1);
  check("PANEL-03: texts may be empty", s.line(2) == "2              00:00");
}
}  // namespace

void testPanel() {
  quiet();
  alarms();
  lines();
  times();
  unusual();
  faults();
  test();
  strange();
}
