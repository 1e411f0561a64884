// A cable with the links at its ends: both directions, their bit errors, and what happens to it by itself.
#pragma once

#include <functional>
#include <memory>
#include <random>

#include "core/network_file.h"
#include "core/slave.h"
#include "core/wire.h"

// A network card of the master: it sends what is queued, and gathers what comes.
class Card {
 public:
  using OnFrame = std::function<void(NibbleFrame&)>;
  Card(double ppm, Time firstSlot, OnFrame onFrame)
      : ppm_(ppm),
        firstSlot_(firstSlot),
        collector_([this, onFrame](NibbleFrame& f) {
          f.start += delay_, f.end += delay_;
          if (link_ && !cut_) onFrame(f);
          cut_ = false;
        }) {}
  // What the card sends goes there; what comes to it has been on its way for `delay`.
  void connect(NibbleSink& to, Time delay) {
    sender_ = std::make_unique<Sender>(to, ppm_, firstSlot_);
    delay_ = delay;
  }
  NibbleSink& receiver() { return collector_; }
  Sender& sender() { return *sender_; }
  void setLink(bool up) {
    link_ = up;
    if (!up) cut_ = collector_.inFrame();
  }

 private:
  double ppm_;
  Time firstSlot_, delay_ = 0;
  bool link_ = true, cut_ = false;  // cut_: the link was lost within the frame that comes
  FrameCollector collector_;
  std::unique_ptr<Sender> sender_;
};

class Link {
 public:
  // A port of a slave, or a card of the master.
  struct End {
    Slave* slave = nullptr;
    int port = 0;
    Card* card = nullptr;
  };
  Link(const CableSpec& spec, End near, End far, uint64_t seed);

  // Cuts or mends the cable: both ends have a link while it is whole.
  void setWhole(bool whole);
  void setBitErrors(uint64_t bits);
  // How often it drops by itself, and for how long, in the mean; it comes back if it has dropped.
  void setDrops(double perSecond, double us, Time now);
  uint64_t bitsFlipped() const { return there_->flipped() + back_->flipped(); }
  uint64_t drops() const { return drops_; }

  // When the link next drops or comes back by itself.
  Time next() const { return next_; }
  // Lets it, if it is time.
  void change(Time now);

 private:
  std::unique_ptr<Noise> connect(const CableSpec& spec, End from, End to);
  void update();
  Time after(double meanUs);

  End near_, far_;
  double dropEveryUs_ = 0, dropUs_ = 0;
  std::mt19937_64 random_;
  std::unique_ptr<Noise> there_, back_;
  bool whole_ = true, dropped_ = false;
  uint64_t drops_ = 0;
  Time next_ = kNever;
};
