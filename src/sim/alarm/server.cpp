#include "alarm/server.h"

#include <algorithm>

#include "core/esc.h"
#include "protocol.h"

extern "C" {
#include "ascon.h"
}

namespace {
// Where the headers of a UDP datagram in an Ethernet frame begin, and what it carries.
constexpr size_t kIp = 14, kUdp = 34, kPayload = 42;
constexpr size_t kIpProtocol = kIp + 9, kUdpLength = kUdp + 4, kUdpChecksum = kUdp + 6;

Bytes part(const Bytes& b, size_t from, size_t to) {
  return Bytes(b.begin() + static_cast<long>(from), b.begin() + static_cast<long>(to));
}

// The sum of 16-bit words with its carries; an odd byte at the end is the high one of a word.
uint32_t sumOf(const Bytes& b, size_t from, size_t to) {
  uint32_t sum = 0;
  for (size_t i = from; i < to; i += 2) sum += static_cast<uint32_t>(b[i] << 8 | (i + 1 < to ? b[i + 1] : 0));
  while (sum >> 16) sum = (sum & 0xffff) + (sum >> 16);
  return sum;
}

// The checksum of a UDP datagram is right, or there is none.
bool hasRightSum(const Bytes& frame, size_t end) {
  if (big(frame, kUdpChecksum, 2) == 0) return true;
  uint32_t sum =
      sumOf(frame, kIp + 12, kUdp) + esc::kUdp + big(frame, kUdpLength, 2) + sumOf(frame, kUdp, end);
  while (sum >> 16) sum = (sum & 0xffff) + (sum >> 16);
  return sum == 0xffff;
}

Bytes nonceOf(const Bytes& life, uint8_t origin, uint32_t counter) {
  Bytes nonce = life;
  putBig(nonce, origin, 1), putBig(nonce, 0, 3), putBig(nonce, counter, 4);
  return nonce;
}
}  // namespace

bool isComplete(const ReportServer& server, size_t slaves) {
  const auto& reported = server.line().slaves;
  return reported.size() == slaves && std::all_of(reported.begin(), reported.end(), [](const auto& s) {
           return !(s.first & (PROTOCOL_SLAVE_ABSENT | PROTOCOL_SLAVE_HOST_DEAD));
         });
}

uint32_t big(const Bytes& b, size_t at, int bytes) {
  uint32_t v = 0;
  for (int i = 0; i < bytes; ++i) v = v << 8 | b[at + static_cast<size_t>(i)];
  return v;
}

void putBig(Bytes& b, uint64_t v, int bytes) {
  while (bytes-- > 0) b.push_back(static_cast<uint8_t>(v >> (8 * bytes)));
}

void putIpChecksum(Bytes& frame) {
  frame[24] = frame[25] = 0;
  const uint32_t sum = ~sumOf(frame, kIp, kUdp);
  frame[24] = static_cast<uint8_t>(sum >> 8), frame[25] = static_cast<uint8_t>(sum);
}

ReportServer::ReportServer(AlarmNetwork& network, const AlarmOptions& options)
    : network_(network),
      master_(options.master) {
  std::mt19937_64 random(options.line.seed);
  putBig(life_, random() | 1, PROTOCOL_LIFE_BYTES);
  network.onFromMaster = [this](const NibbleFrame& f, const Bytes& b) { take(f, b); };
}

uint32_t ReportServer::order(uint8_t order, uint16_t node, uint16_t seconds) {
  order_ = order, node_ = node, seconds_ = seconds;
  return ++ticket_;
}

void ReportServer::tag(Bytes& answer, const uint8_t* key) {
  const Bytes nonce =
      nonceOf(part(answer, PROTOCOL_ANSWER_SERVER_AT, PROTOCOL_ANSWER_SERVER_AT + PROTOCOL_LIFE_BYTES),
              PROTOCOL_OF_SERVER, big(answer, PROTOCOL_ANSWER_TURN_AT, 4));
  answer.resize(PROTOCOL_ANSWER_BYTES);
  ascon_tag(&answer[PROTOCOL_ANSWER_TAG_AT], key, nonce.data(), answer.data(), PROTOCOL_ANSWER_TAG_AT);
}

Bytes ReportServer::answer(uint32_t number) {
  Bytes a;
  putBig(a, PROTOCOL_MAGIC, 2), putBig(a, PROTOCOL_VERSION, 1), putBig(a, PROTOCOL_KIND_ANSWER, 1);
  putBig(a, master_.master_id, 2), putBig(a, 0, 2);
  a.insert(a.end(), masterLife_.begin(), masterLife_.end());
  a.insert(a.end(), life_.begin(), life_.end());
  putBig(a, ++turn_, 4), putBig(a, counter_, 4), putBig(a, number, 4), putBig(a, order_ ? ticket_ : 0, 4);
  putBig(a, order_, 1), putBig(a, 0, 1), putBig(a, node_, 2), putBig(a, seconds_, 2), putBig(a, 0, 2);
  tag(a, master_.key);
  return a;
}

// To where the last report came from.
Bytes ReportServer::frame(const Bytes& data) const {
  const auto length = static_cast<uint32_t>(data.size());
  Bytes f;
  for (const Bytes& mac : {part(report_, 6, 12), part(report_, 0, 6)})
    f.insert(f.end(), mac.begin(), mac.end());
  putBig(f, esc::kIpv4, 2);
  putBig(f, 0x4500, 2), putBig(f, 20 + 8 + length, 2), putBig(f, 0, 4), putBig(f, 0x4000 | esc::kUdp, 2),
      putBig(f, 0, 2);
  for (const Bytes& ip : {part(report_, 30, 34), part(report_, 26, 30)})
    f.insert(f.end(), ip.begin(), ip.end());
  putBig(f, big(report_, kUdp + 2, 2), 2), putBig(f, big(report_, kUdp, 2), 2), putBig(f, 8 + length, 2),
      putBig(f, 0, 2);
  f.insert(f.end(), data.begin(), data.end());
  putIpChecksum(f);
  return f;
}

Bytes ReportServer::report() const { return part(report_, kPayload, kUdp + big(report_, kUdpLength, 2)); }

// Its lengths fit, it is of this master, and its tag is right.
bool ReportServer::isRight(const Bytes& r) const {
  if (r.size() < PROTOCOL_REPORT_BYTES + PROTOCOL_REPORT_END_BYTES) return false;
  const size_t rest = PROTOCOL_REPORT_BYTES + r[PROTOCOL_REPORT_SLAVES_AT] * PROTOCOL_REPORTED_SLAVE_BYTES +
                      r[PROTOCOL_REPORT_COUNT_AT] * PROTOCOL_EVENT_BYTES;
  if (r.size() != rest + PROTOCOL_REPORT_END_BYTES || r[PROTOCOL_REPORT_COUNT_AT] > PROTOCOL_MOST_EVENTS ||
      big(r, PROTOCOL_REPORT_MAGIC_AT, 2) != PROTOCOL_MAGIC ||
      r[PROTOCOL_REPORT_VERSION_AT] != PROTOCOL_VERSION ||
      r[PROTOCOL_REPORT_KIND_AT] != PROTOCOL_KIND_REPORT ||
      big(r, PROTOCOL_REPORT_MASTER_AT, 2) != master_.master_id)
    return false;
  const Bytes nonce = nonceOf(part(r, PROTOCOL_REPORT_LIFE_AT, PROTOCOL_REPORT_LIFE_AT + PROTOCOL_LIFE_BYTES),
                              PROTOCOL_OF_MASTER, big(r, PROTOCOL_REPORT_COUNTER_AT, 4));
  uint8_t tag[PROTOCOL_TAG_BYTES];
  ascon_tag(tag, master_.key, nonce.data(), r.data(), rest);
  return ascon_same(tag, &r[rest + PROTOCOL_REPORT_END_TAG_AT]);
}

void ReportServer::takeEvents(const NibbleFrame& f, const Bytes& r, size_t at) {
  const uint32_t first = big(r, PROTOCOL_REPORT_NUMBER_AT, 4), count = r[PROTOCOL_REPORT_COUNT_AT];
  for (uint32_t i = 0; i < count; ++i, at += PROTOCOL_EVENT_BYTES) {
    if (first + i < next_) continue;
    const ReportedEvent e{r[at + PROTOCOL_EVENT_KIND_AT], r[at + PROTOCOL_EVENT_POSITION_AT],
                          big(r, at + PROTOCOL_EVENT_NODE_AT, 2), big(r, at + PROTOCOL_EVENT_SEQUENCE_AT, 2),
                          r[at + PROTOCOL_EVENT_STATE_AT]};
    next_ = first + i + 1;
    if (e.kind == PROTOCOL_EVENT_COMMAND && order_ && e.sequence == (ticket_ & 0xffff)) order_ = 0;
    if (onEvent) onEvent(f, e);
  }
}

void ReportServer::take(const NibbleFrame& f, const Bytes& b) {
  if (b.size() < kPayload || big(b, 12, 2) != esc::kIpv4 || b[kIpProtocol] != esc::kUdp) return;
  const size_t end = kUdp + big(b, kUdpLength, 2);
  if (end < kPayload || end > b.size() || !hasRightSum(b, end) || !isRight(part(b, kPayload, end))) {
    ++refused_;
    return;
  }
  const Bytes r = part(b, kPayload, end),
              life = part(r, PROTOCOL_REPORT_LIFE_AT, PROTOCOL_REPORT_LIFE_AT + PROTOCOL_LIFE_BYTES);
  const uint32_t counter = big(r, PROTOCOL_REPORT_COUNTER_AT, 4);
  if (life != masterLife_) {
    masterLife_ = life, counter_ = 0, next_ = big(r, PROTOCOL_REPORT_NUMBER_AT, 4), proven_ = false;
  } else if (counter <= counter_) {
    ++refused_;
    return;
  }
  report_ = b, counter_ = counter;
  proven_ = part(r, PROTOCOL_REPORT_SERVER_AT, PROTOCOL_REPORT_SERVER_AT + PROTOCOL_LIFE_BYTES) == life_;
  if (proven_) {
    line_ = {big(r, PROTOCOL_REPORT_STATUS_AT, 4), r[PROTOCOL_REPORT_PRESENT_AT], {}};
    size_t at = PROTOCOL_REPORT_BYTES;
    for (int i = 0; i < r[PROTOCOL_REPORT_SLAVES_AT]; ++i, at += PROTOCOL_REPORTED_SLAVE_BYTES)
      line_.slaves.emplace_back(big(r, at + PROTOCOL_REPORTED_SLAVE_STATUS_AT, 2),
                                big(r, at + PROTOCOL_REPORTED_SLAVE_NODE_AT, 2));
    takeEvents(f, r, at);
  }
  // A report that is not proven has no effect: it may be an old one.
  network_.toMaster(frame(answer(proven_ ? next_ : big(r, PROTOCOL_REPORT_NUMBER_AT, 4))));
}
