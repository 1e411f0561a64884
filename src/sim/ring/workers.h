// Processors that do the same piece of work again and again, each for its share.
#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

class Workers {
 public:
  // `work` gets the number of the processor, 0 to `count` - 1; 0 is the one that calls `run`.
  Workers(size_t count, std::function<void(size_t)> work);
  ~Workers();
  size_t count() const { return threads_.size() + 1; }
  // Does one piece; returns when all have done their share.
  void run();

 private:
  void loop(size_t number);
  void share(size_t number);
  std::function<void(size_t)> work_;
  std::atomic<uint64_t> round_{0};
  std::atomic<size_t> busy_{0};
  std::atomic<bool> ends_{false};
  std::mutex mutex_;
  std::exception_ptr error_;
  std::vector<std::thread> threads_;
};
