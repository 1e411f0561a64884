#include "smsoak/history.h"

#include <cstdio>

namespace smsoak {

namespace {

constexpr size_t kMaxOrders = 20000;

std::string mismatch(const Action& a, const char* what, int expected) {
  char text[200];
  std::snprintf(text, sizeof text,
                "%s step %llu, cycles %llu to %llu: %s 0x%04x is 0x%02x, the model says 0x%02x",
                a.kind >= Action::Kind::hostRead ? "host" : "bus", static_cast<unsigned long long>(a.step),
                static_cast<unsigned long long>(a.from), static_cast<unsigned long long>(a.to), what,
                a.address, a.result, expected);
  return text;
}

// Does `a` to the world; false if the model's answer is another.
bool act(World& w, const Action& a, std::string& why) {
  using Kind = Action::Kind;
  const char* what = "";
  int expected = a.result;
  switch (a.kind) {
    case Kind::frameStarts: w.frameStarts(); break;
    case Kind::frameEnds: w.frameEnds(a.address); break;
    case Kind::perhapsQuiet:
    case Kind::quiet: w.becomesQuiet(); break;
    case Kind::read: {
      what = "bus read of";
      if (isSmRegister(a.address)) {
        expected = w.readRegister(Side::ecat, a.address), w.anyRead = true;
      } else {
        const int place = w.access(Side::ecat, false, a.address);
        expected = place < 0 ? a.value : w.ram[place];
        w.anyRead |= place >= 0;
      }
      break;
    }
    case Kind::write:
      if (isSmRegister(a.address)) {
        w.anyWrite |= w.mayWriteRegister(Side::ecat, a.address);
      } else if (const int place = w.access(Side::ecat, true, a.address); place >= 0) {
        w.ram[place] = a.value, w.anyWrite = true;
      }
      break;
    case Kind::commit: w.writeRegister(Side::ecat, a.address, a.value); break;
    case Kind::irqNibble:
      what = "IRQ field, nibble";
      expected = w.ecatEvents() >> (4 * (a.address - 1)) & 0xf;
      break;
    case Kind::counter:
      what = "increment of the working counter, command";
      expected = w.anyRead + w.anyWrite * (a.address == 3 ? 2 : 1);
      w.anyRead = w.anyWrite = false;
      break;
    case Kind::hostRead:
      what = "host read of";
      if (isSmRegister(a.address)) expected = w.readRegister(Side::pdi, a.address);
      else if (a.address >= kRamStart) {
        const int place = w.access(Side::pdi, false, a.address);
        expected = place < 0 ? 0 : w.ram[place];
      } else if (a.address == kAlEvents) expected = w.activationEvent() << 4;
      else expected = w.alEvents();
      break;
    case Kind::hostWrite:
      if (isSmRegister(a.address)) w.writeRegister(Side::pdi, a.address, a.value);
      else if (const int place = w.access(Side::pdi, true, a.address); place >= 0) w.ram[place] = a.value;
      break;
    case Kind::interrupt:
      what = "interrupt";
      expected = w.alEvents() != 0;
      break;
  }
  if (a.result < 0 || expected == a.result) return true;
  // The last ones tell most.
  why = mismatch(a, what, expected) + (why.empty() ? "" : "\n") + why.substr(0, 600);
  return false;
}

// What happened around the mismatch, for whoever looks for the reason.
std::string around(const History& bus, const History& host, uint64_t from, uint64_t to) {
  static const char* const names[] = {"frame starts", "read",       "write",  "IRQ nibble",
                                      "counter",      "frame ends", "commit", "perhaps quiet",
                                      "quiet",        "read",       "write",  "interrupt"};
  std::string text;
  for (const auto* history : {&bus, &host})
    for (const Action& a : *history) {
      if (a.to + 100 < from || a.from > to + 40) continue;
      char line[160];
      std::snprintf(line, sizeof line, "\n  %s, cycles %llu to %llu: %s 0x%04x, value 0x%02x, result %d",
                    history == &bus ? "bus" : "host", static_cast<unsigned long long>(a.from),
                    static_cast<unsigned long long>(a.to), names[static_cast<int>(a.kind)], a.address,
                    a.value, a.result);
      text += line;
    }
  return text;
}

// `a` meets none of `others` from `first` on that could come before it.
bool commutes(const Action& a, const History& others, size_t first) {
  for (size_t k = first; k < others.size() && !(a.to < others[k].from); ++k)
    if (a.managers & others[k].managers) return false;
  return true;
}

struct Order {
  size_t bus;  // how many actions of the bus are done
  World world;
};

void add(std::vector<Order>& orders, size_t bus, const World& world) {
  for (const Order& o : orders)
    if (o.bus == bus && o.world == world) return;
  orders.push_back({bus, world});
}

}  // namespace

// Breadth first: all orders of the first `done` actions at a time. Equal worlds are one, and actions that do
// not concern each other are taken in one order only, so there are seldom more than a few.
bool merge(std::vector<World>& worlds, const History& bus, const History& host, std::string& why) {
  std::vector<Order> orders, next;
  for (const World& w : worlds) add(orders, 0, w);
  for (size_t done = 0; done < bus.size() + host.size(); ++done) {
    next.clear();
    for (Order& o : orders) {
      const size_t i = o.bus, j = done - i;
      bool byBus = i < bus.size() && (j == host.size() || bus[i].from <= host[j].to);
      bool byHost = j < host.size() && (i == bus.size() || host[j].from <= bus[i].to);
      if (byBus && byHost) {
        if (commutes(bus[i], host, j)) byHost = false;
        else if (commutes(host[j], bus, i)) byBus = false;
      }
      if (byBus && bus[i].kind == Action::Kind::perhapsQuiet) add(next, i + 1, o.world);
      if (byBus && byHost) {
        World copy = o.world;
        if (act(copy, bus[i], why)) add(next, i + 1, copy);
      } else if (byBus && act(o.world, bus[i], why)) {
        add(next, i + 1, o.world);
      }
      if (byHost && act(o.world, host[j], why)) add(next, i, o.world);
    }
    if (next.empty()) {
      const Order& o = orders.front();
      const Action& a = o.bus < bus.size() ? bus[o.bus] : host[done - o.bus];
      why += around(bus, host, a.from, a.to);
      return false;
    }
    if (next.size() > kMaxOrders) return why = "too many possible orders", false;
    orders.swap(next);
  }
  worlds.clear();
  for (const Order& o : orders) worlds.push_back(o.world);
  return true;
}

}  // namespace smsoak
