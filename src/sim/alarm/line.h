// The alarm line: a master, its slaves with their detectors, the cables between them, in a ring also the one
// back to the master, and the cable to the plant network.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "alarm/detector.h"
#include "core/wire.h"
#include "core/slave.h"

// A second processor for idle times, when the slaves have nothing to do with each other.
class Helper {
 public:
  Helper() : thread_([this] { loop(); }) {}
  ~Helper();
  // Runs `theirs` while `ours` runs; returns when both are done.
  void both(const std::function<void()>& ours, const std::function<void()>& theirs);

 private:
  void loop();
  std::mutex mutex_;
  std::condition_variable wake_;
  const std::function<void()>* work_ = nullptr;
  bool ends_ = false;
  std::exception_ptr error_;
  std::thread thread_;
};

struct AlarmLineOptions {
  size_t slaves = 5;
  bool ring = false;       // a cable leads from the last slave back to the master's port 2
  uint64_t seed = 1;       // phases of the clocks, bit errors
  uint64_t bitErrors = 0;  // on each line cable one bit of so many is flipped; 0: none
  double cableNs = 50;
};

class AlarmLine {
 public:
  // The host program of the master (0) or of a slave, made anew at each power-up.
  using MakeHost = std::function<std::unique_ptr<Host>(size_t node)>;

  AlarmLine(const AlarmLineOptions& options, MakeHost makeHost);

  Time now() const { return sim_.now(); }
  int64_t ns() const { return sim_.now() / kNs; }
  size_t slaves() const { return nodes_.size() - 1; }
  // 0 is the master, 1 the first slave.
  Slave& node(size_t i) { return *nodes_[i]; }
  SmokeDetector& detector(size_t slave) { return detectors_[slave]; }
  // To be called when a detector has been changed.
  void updateDetector(size_t slave);
  // A bad contact: so often in a second the current is the one of `comparators` instead, for half of the
  // period. 0: never.
  void setChatter(size_t slave, double hz, unsigned comparators);
  double chatter(size_t slave) const { return chatter_[slave].hz; }

  // Cable i leads to slave i; in a ring the one behind the last slave leads to the master.
  size_t cables() const { return cables_.size(); }
  void setCable(size_t number, bool whole);
  bool cable(size_t number) const { return cables_[number - 1].whole; }
  // One bit of so many is flipped on a cable from now on; 0: none.
  void setNoise(size_t number, uint64_t bits);
  // Takes the power of a node away for so long; its host starts anew then.
  void restart(size_t node, int64_t offNs);
  // Takes it away until it is given back.
  void setPower(size_t node, bool on);
  bool powered(size_t node) const { return powerAt_[node] == kNever; }
  // Ends the host program of a node, whose controller goes on, or starts it anew.
  void setHost(size_t node, bool runs);
  // Writes a register as the program of a node does that has ended since. False if one runs.
  bool writeRegister(size_t node, uint16_t address, uint8_t value);

  // A frame for the master from the plant network, which leaves when those before have.
  void sendToPlant(const Bytes& frame);
  size_t plantBacklog() const { return plantSender_->backlog(); }
  // Good frames, when their last nibble is out: of the master into the plant network; to the master; on the
  // line, sent by the master and come back to it.
  std::function<void(const NibbleFrame&, const Bytes&)> onFromMaster, onToMaster, onLineOut, onLineBack;

  // Simulates some time: idle time in slices, else a few events.
  void advance(int64_t limitNs = kIdleSliceNs);
  // Something is on a wire.
  bool busy() const;

  uint64_t bitsFlipped() const;
  uint64_t linesSent() const { return lineSent_; }
  uint64_t linesBack() const { return lineBack_; }
  uint64_t linesBad() const { return lineBad_; }

  static constexpr int64_t kIdleSliceNs = 10'000;

 private:
  struct Cabling {
    size_t near;
    int nearPort;
    size_t far;
    int farPort;
    bool whole = true;
  };
  struct Chatter {
    double hz = 0;
    Time half = 0, next = kNever;
    bool wrong = false;
    unsigned comparators = 0;
  };

  void connect(const Cabling& cable, const AlarmLineOptions& options, std::mt19937_64& random);
  void updateCables();
  void idle(Time end);
  void switchPower();
  void switchChatter();

  MakeHost makeHost_;
  std::vector<std::unique_ptr<VerilatedContext>> contexts_;  // one each: two of them may be evaluated at once
  Simulator sim_;
  std::vector<std::unique_ptr<Slave>> nodes_;
  std::vector<SmokeDetector> detectors_;       // by slave; 0 unused
  std::vector<std::unique_ptr<Noise>> noise_;  // of each cable two, one for each direction
  std::vector<std::unique_ptr<Tap>> taps_;
  std::unique_ptr<Sender> plantSender_;
  std::unique_ptr<FrameCollector> plantCollector_;
  std::vector<Cabling> cables_;   // 0 is the first one
  std::vector<Chatter> chatter_;  // by slave; 0 unused
  Time nextChatter_ = kNever;
  std::vector<Time> powerAt_;  // when a node gets its power back; kNever: it has it
  Time nextPower_ = kNever;
  uint64_t lineSent_ = 0, lineBack_ = 0, lineBad_ = 0;
  Helper helper_;
};
