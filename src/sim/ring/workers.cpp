#include "ring/workers.h"

#include <utility>

namespace {
constexpr int kSpins = 20'000;  // then others get the processor, too

template <class Condition>
void spinUntil(Condition condition) {
  for (int i = 0; !condition(); ++i)
    if (i >= kSpins) std::this_thread::yield();
}
}  // namespace

Workers::Workers(size_t count, std::function<void(size_t)> work) : work_(std::move(work)) {
  for (size_t i = 1; i < count; ++i) threads_.emplace_back([this, i] { loop(i); });
}

Workers::~Workers() {
  ends_ = true;
  ++round_;
  for (std::thread& t : threads_) t.join();
}

void Workers::share(size_t number) {
  try {
    work_(number);
  } catch (...) {
    const std::lock_guard lock(mutex_);
    error_ = std::current_exception();
  }
}

void Workers::loop(size_t number) {
  for (uint64_t done = 0;; ++done) {
    spinUntil([&] { return round_.load(std::memory_order_acquire) > done; });
    if (ends_) return;
    share(number);
    busy_.fetch_sub(1, std::memory_order_release);
  }
}

void Workers::run() {
  busy_ = threads_.size();
  round_.fetch_add(1, std::memory_order_release);
  share(0);
  spinUntil([&] { return busy_.load(std::memory_order_acquire) == 0; });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}
