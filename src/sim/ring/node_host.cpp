#include "ring/node_host.h"

#include <algorithm>

#include "core/slave.h"
#include "core/user_error.h"

namespace {
constexpr uint32_t kPassUs = 1000;
constexpr size_t kInbox = 10'000;  // messages kept for the bench; older ones are forgotten

std::vector<unsigned> addressesIn(const uint8_t* map) {
  std::vector<unsigned> addresses;
  for (unsigned a = 0; a < TRANSPORT_NODES; ++a)
    if (map[a / 8] >> a % 8 & 1) addresses.push_back(a);
  return addresses;
}

void takePlace(std::set<std::pair<unsigned, unsigned>>& objects, std::pair<unsigned, unsigned> one,
               size_t most, const char* does) {
  if (objects.size() >= most && objects.count(one) == 0)
    throw UserError("the node already " + std::string(does) + " " + std::to_string(most) + " objects.");
  objects.insert(one);
}
}  // namespace

unsigned RingNodeHost::send(unsigned destination, bool urgent, const Bytes& data) {
  tag_ = (tag_ + 1) & 0xffff;
  // Urgent ones wait for urgent ones only.
  const auto place =
      std::find_if(wanted_.begin(), wanted_.end(), [&](const Wanted& w) { return urgent && !w.urgent; });
  wanted_.insert(place, {tag_, destination, urgent, data});
  asked_ = true;
  return tag_;
}

void RingNodeHost::setObject(unsigned destination, unsigned number, const Bytes& data) {
  takePlace(set_, {destination, number}, TRANSPORT_OBJECTS, "sends");
  objects_.push_back({destination, number, data});
  asked_ = true;
}

void RingNodeHost::watch(unsigned source, unsigned number) {
  takePlace(watched_, {source, number}, TRANSPORT_WATCHED, "follows");
  asked_ = true;
}

std::vector<RingNodeHost::Message> RingNodeHost::messages(size_t most) {
  const auto end = inbox_.begin() + static_cast<std::ptrdiff_t>(std::min(most, inbox_.size()));
  std::vector<Message> taken(inbox_.begin(), end);
  inbox_.erase(inbox_.begin(), end);
  return taken;
}

std::vector<RingNodeHost::End> RingNodeHost::ends() {
  std::vector<End> taken(ends_.begin(), ends_.end());
  ends_.clear();
  return taken;
}

std::vector<unsigned> RingNodeHost::members() const {
  uint8_t map[TRANSPORT_MAP_BYTES];
  if (!node_.began) return {};
  transport_members(&node_.transport, map, node_.now_us);
  return addressesIn(map);
}

std::vector<RingNodeHost::Value> RingNodeHost::values() const {
  std::vector<Value> all;
  if (!node_.began) return all;
  for (const auto& [source, number] : watched_) {
    uint8_t data[RING_FRAME_BYTES];
    bool old;
    const uint8_t length = transport_value(&node_.transport, static_cast<uint8_t>(source),
                                           static_cast<uint8_t>(number), data, &old, node_.now_us);
    all.push_back({source, number, old, Bytes(data, data + length)});
  }
  return all;
}

void RingNodeHost::take() {
  const transport_message* m;
  while (takes_ != Takes::none && (m = transport_received(&node_.transport)) != nullptr) {
    const bool refuse = takes_ == Takes::refuses;
    if (!refuse) {
      inbox_.push_back({slave().nextRise(), m->source, m->pipe, m->number, m->to_all, m->urgent, m->repeat,
                        Bytes(m->data, m->data + m->length)});
      if (inbox_.size() > kInbox) inbox_.pop_front();
      ++received_;
    }
    transport_take(&node_.transport, m, refuse);
    asked_ = true;  // the sender is to be told
  }
  transport_end end;
  while (transport_ended(&node_.transport, &end)) {
    ends_.push_back({end.tag, end.outcome, addressesIn(end.unconfirmed)});
    if (ends_.size() > kInbox) ends_.pop_front();
    underWay_.erase(end.tag);
    asked_ = true;  // there is a place
  }
}

// What finds no place waits.
void RingNodeHost::serveBench() {
  transport* t = &node_.transport;
  while (!wanted_.empty()) {
    const Wanted& w = wanted_.front();
    const Bytes& data = underWay_[w.tag] = w.data;
    if (!transport_send(t, static_cast<uint16_t>(w.tag), static_cast<uint8_t>(w.destination), w.urgent,
                        data.data(), static_cast<uint16_t>(data.size()), nullptr, node_.now_us)) {
      underWay_.erase(w.tag);
      break;
    }
    wanted_.pop_front();
    asked_ = true;
  }
  for (; !objects_.empty(); objects_.pop_front(), asked_ = true) {
    const Object& o = objects_.front();
    transport_object(t, static_cast<uint8_t>(o.destination), static_cast<uint8_t>(o.number), o.data.data(),
                     static_cast<uint8_t>(o.data.size()));
  }
  for (const auto& [source, number] : watched_)
    transport_watch(t, static_cast<uint8_t>(source), static_cast<uint8_t>(number));
  if (clear_) ring_node_clear_conflict(&node_);
  clear_ = false;
}

void RingNodeHost::run() {
  boot();
  ring_node_start(&node_, &board_, &parameters_);
  for (;;) {
    ring_node_wait(&node_, asked_ ? 0 : kPassUs);
    endPass();
    asked_ = false;
    ring_node_serve(&node_);
    if (!node_.began) continue;
    take();
    serveBench();
  }
}
