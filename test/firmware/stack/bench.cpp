#include "bench.h"

#include <algorithm>

namespace {
Program& of(void* context) { return *static_cast<Program*>(context); }

uint32_t openFile(void* context, const char* name, uint16_t length, uint32_t password, bool) {
  Program& p = of(context);
  p.opened.assign(name, length), p.password = password, ++p.opens;
  if (p.busyOpening > 0) return --p.busyOpening, SLAVE_FILE_BUSY;
  if (p.openError) return p.openError;
  return p.opened == p.name ? 0 : FOE_NOT_FOUND;
}
uint32_t readFile(void* context, uint32_t offset, uint8_t* data, uint16_t most, uint16_t* length) {
  Program& p = of(context);
  if (p.busyReading > 0) return --p.busyReading, SLAVE_FILE_BUSY;
  if (p.fileError) return p.fileError;
  *length = static_cast<uint16_t>(
      std::min<size_t>(most, p.content.size() - std::min<size_t>(offset, p.content.size())));
  std::copy_n(p.content.begin() + std::min<size_t>(offset, p.content.size()), *length, data);
  return 0;
}
uint32_t writeFile(void* context, uint32_t offset, const uint8_t* data, uint16_t length, bool) {
  Program& p = of(context);
  if (p.busy > 0) return --p.busy, SLAVE_FILE_BUSY;
  if (p.fileError) return p.fileError;
  if (p.content.size() > 1 << 16) return FOE_DENIED;
  p.content.resize(offset);
  p.content.insert(p.content.end(), data, data + length);
  return 0;
}
void closeFile(void* context, bool complete) {
  ++(complete ? of(context).closedWell : of(context).closedBadly);
}
}  // namespace

Bench::Bench() {
  application.context = &program;
  program.output = &demo.objects.object_7000_01;
  application.may_enter = [](void* p, uint8_t state) {
    return state == of(p).refuseState ? of(p).refuseCode : uint16_t{0};
  };
  application.entered = [](void* p, uint8_t state) { of(p).entered.push_back(state); };
  application.cycle = [](void* p, bool valid) {
    ++of(p).cycles, of(p).validCycles += valid, of(p).lastValid = valid;
    of(p).lastOutput = *of(p).output;
  };
  application.may_write = [](void* p, uint16_t, uint8_t, const uint8_t*, uint16_t) {
    return of(p).refuseWrite;
  };
  application.written = [](void* p, uint16_t index, uint8_t sub) {
    if (of(p).written.size() < 1000) of(p).written.push_back(static_cast<uint32_t>(index << 8 | sub));
  };
  application.reads = [](void* p, uint16_t index, uint8_t sub) {
    if (of(p).reads.size() < 1000) of(p).reads.push_back(static_cast<uint32_t>(index << 8 | sub));
  };
  application.files = {openFile, readFile, writeFile, closeFile};
  c.setWord(0x0420, 1000);
  start();
}

void Bench::start() {
  slave_demo_start(&demo, &c, &application);
  request_.assign(sizeof demo.request, 0), transfer_.assign(sizeof demo.transfer, 0);
  for (auto& reply : reply_) reply.assign(sizeof demo.reply[0], 0);
  process_.assign(sizeof demo.process, 0);
  outputs_.assign(sizeof demo.outputs / sizeof demo.outputs[0], {});
  inputs_.assign(sizeof demo.inputs / sizeof demo.inputs[0], {});
  for (auto* v : {&request_, &reply_[0], &reply_[1], &transfer_, &process_}) v->shrink_to_fit();
  const slave_memory memory = {reinterpret_cast<uint8_t*>(&demo.objects),
                               request_.data(),
                               {reply_[0].data(), reply_[1].data()},
                               transfer_.data(),
                               process_.data(),
                               outputs_.data(),
                               inputs_.data()};
  slave_start(&demo.slave, &c, &device, &memory, &application);
}

void Bench::gap(uint16_t index, uint8_t subindex) {
  objects_.assign(device.objects, device.objects + device.object_count);
  for (object& o : objects_) {
    if (o.index != index) continue;
    entries_.assign(o.entries, o.entries + o.highest + 1);
    entries_[subindex] = {0, 0, 0, 0, "", nullptr};
    o.entries = entries_.data();
  }
  device.objects = objects_.data();
}

void Bench::mailboxes(unsigned length) {
  c.setSyncManager(0, 0x1000, static_cast<uint16_t>(length), 0x26);
  c.setSyncManager(1, 0x1080, static_cast<uint16_t>(length), 0x22);
  boxBytes = length, counter_ = 0;
}
void Bench::bootMailboxes() {
  c.setSyncManager(0, 0x1000, kBoot, 0x26);
  c.setSyncManager(1, 0x1100, kBoot, 0x22);
  boxBytes = kBoot, counter_ = 0;
}
void Bench::process(unsigned out, unsigned in) {
  c.setSyncManager(2, 0x1100, static_cast<uint16_t>(out), 0x64, out > 0);
  c.setSyncManager(3, 0x1200, static_cast<uint16_t>(in), 0x20, in > 0);
}

unsigned Bench::request(uint16_t control) {
  c.control(control);
  serve();
  return c.status();
}

bool Bench::to(uint8_t state) {
  if (state == AL_BOOT) bootMailboxes();
  else mailboxes();
  if (state == AL_BOOT) return request(AL_BOOT) == AL_BOOT;
  if (request(AL_PREOP) != AL_PREOP) return false;
  if (state == AL_PREOP) return true;
  process();
  if (request(AL_SAFEOP) != AL_SAFEOP) return false;
  if (state == AL_SAFEOP) return true;
  outputs({0, 0, 0});
  serve();
  return request(AL_OP) == AL_OP;
}

int Bench::nextCounter() { return counter_ = counter_ % 7 + 1; }

bool Bench::post(int type, const Bytes& data, int counter, int channel, int length) {
  if (counter < 0) counter = nextCounter();
  Bytes m = little(static_cast<uint64_t>(length < 0 ? static_cast<int>(data.size()) : length), 2);
  m.insert(m.end(), {0, 0, static_cast<uint8_t>(channel), static_cast<uint8_t>(type | counter << 4)});
  m = join(m, data);
  m.resize(boxBytes);
  return c.write(0, m);
}

Bench::Message Bench::fetch(int passes) {
  Bytes m;
  for (int i = 0; i <= passes; ++i) {
    if (c.read(1, m)) {
      const size_t length = number(m, 0, 2);
      if (length + 6 > m.size()) return {-2, 0, {}};
      return {m[5] & 0xf, m[5] >> 4 & 7, Bytes(m.begin() + 6, m.begin() + 6 + static_cast<long>(length))};
    }
    serve(1);
  }
  return {};
}

Bytes Bench::little(uint64_t v, int bytes) {
  Bytes b;
  for (int i = 0; i < bytes; ++i) b.push_back(static_cast<uint8_t>(v >> 8 * i));
  return b;
}
uint64_t Bench::number(const Bytes& b, size_t at, int bytes) {
  uint64_t v = 0;
  for (int i = bytes; i-- > 0;)
    v = v << 8 | (at + static_cast<size_t>(i) < b.size() ? b[at + static_cast<size_t>(i)] : 0);
  return v;
}

// 0: the reply is no abort. 1: it is nothing that there is.
uint32_t Bench::abortOf(const Bytes& reply) {
  if (reply.size() < 10) return 1;
  if (reply[2] != 0x80) return 0;
  const auto code = static_cast<uint32_t>(number(reply, 6, 4));
  // It names the entry of the transfer; there is none for a segment of no transfer.
  const uint64_t named = number(reply, 3, 3), expected = code == 0x05040001 && segment_ ? 0 : entry_;
  return reply.size() == 10 && reply[0] == 0 && reply[1] == 0x20 && named == expected ? code : 2;
}

Bytes Bench::sdo(const Bytes& command) {
  const int specifier = command.at(0) >> 5;
  segment_ = specifier == 0 || specifier == 3;
  if (!segment_) entry_ = number(command, 1, 3);
  return ask(3, join({0, 0x20}, command)).data;
}

Bench::Result Bench::upload(uint16_t index, int subindex, bool complete) {
  Bytes r = sdo({static_cast<uint8_t>(0x40 | complete << 4), static_cast<uint8_t>(index),
                 static_cast<uint8_t>(index >> 8), static_cast<uint8_t>(subindex), 0, 0, 0, 0});
  if (const uint32_t code = abortOf(r)) return {code, {}};
  if (r[1] != 0x30 || (r[2] & 0xf1) != (0x41 | complete << 4) || number(r, 3, 2) != index || r[5] != subindex)
    return {1, {}};
  if (r[2] & 2) return {0, Bytes(r.begin() + 6, r.begin() + 6 + (4 - (r[2] >> 2 & 3)))};
  const size_t size = number(r, 6, 4);
  Bytes data(r.begin() + 10, r.end());
  if (size == 0) data.clear();
  if (data.size() < size && !data.empty()) return {1, {}};
  for (uint8_t toggle = 0; data.size() < size; toggle ^= 0x10) {
    r = sdo({static_cast<uint8_t>(0x60 | toggle), 0, 0, 0, 0, 0, 0, 0});
    if (const uint32_t code = abortOf(r)) return {code, {}};
    if ((r[2] & 0xf0) != toggle) return {1, {}};
    size_t count = r.size() - 3;
    if (count == 7) count -= r[2] >> 1 & 7;
    data.insert(data.end(), r.begin() + 3, r.begin() + 3 + static_cast<long>(count));
    if ((r[2] & 1) != (data.size() >= size)) return {1, {}};
  }
  return data.size() == size ? Result{0, data} : Result{1, {}};
}

uint32_t Bench::download(uint16_t index, int subindex, const Bytes& data, bool complete, Way way) {
  const auto head = [&](int command) {
    return Bytes{static_cast<uint8_t>(command | complete << 4), static_cast<uint8_t>(index),
                 static_cast<uint8_t>(index >> 8), static_cast<uint8_t>(subindex)};
  };
  if (way == automatic) way = data.size() <= 4 && !data.empty() ? expedited : normal;
  Bytes r;
  if (way == expedited || way == unsized) {
    Bytes four = data;
    four.resize(4);
    r = sdo(join(head(way == unsized ? 0x22 : 0x23 | (4 - static_cast<int>(data.size())) << 2), four));
    return abortOf(r) ? abortOf(r) : r[2] == (0x60 | complete << 4) ? 0 : 1;
  }
  const size_t room = boxBytes - 16, first = way == segmented ? std::min<size_t>(data.size() / 3, room)
                                                              : std::min(data.size(), room);
  size_t done = first;
  r = sdo(join(join(head(0x21), little(data.size(), 4)),
               Bytes(data.begin(), data.begin() + static_cast<long>(first))));
  if (abortOf(r)) return abortOf(r);
  if (r[2] != (0x60 | complete << 4) || number(r, 3, 2) != index || r[5] != subindex) return 1;
  for (uint8_t toggle = 0; done < data.size(); toggle ^= 0x10) {
    const size_t count = std::min<size_t>(data.size() - done, way == segmented ? 5 : boxBytes - 9);
    Bytes part(data.begin() + static_cast<long>(done), data.begin() + static_cast<long>(done + count));
    uint8_t command = toggle;
    if (count < 7) command |= static_cast<uint8_t>((7 - count) << 1), part.resize(7);
    done += count;
    if (done == data.size()) command |= 1;
    r = sdo(join({command}, part));
    if (abortOf(r)) return abortOf(r);
    if (r[2] != (0x20 | toggle)) return 1;
  }
  return 0;
}
