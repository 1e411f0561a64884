#include "hosts/measure.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace hosts {
namespace {
constexpr unsigned kBlock = 64;  // bytes

struct Figure {
  double mean = 0, worst = 0;  // ps
};

// Aligned as the bus likes it.
Figure figure(Core& core, Host& host, Random& random, bool write, unsigned bytes, int accesses) {
  Figure f;
  std::vector<uint8_t> data(bytes, 0x5a);
  for (int i = 0; i < accesses; ++i) {
    const unsigned address = place::kHost + random.below((place::kHostBytes - bytes) / 4) * 4;
    // A multiple of neither clock's period between two of them.
    core.cycle(1 + static_cast<int>(random.below(50)));
    core.wait(random.below(static_cast<unsigned>(core.period())));
    const Time begin = core.now();
    if (write) host.write(address, data.data(), bytes);
    else host.read(address, data.data(), bytes);
    const auto took = static_cast<double>(core.now() - begin);
    f.mean += took / accesses, f.worst = std::max(f.worst, took);
  }
  return f;
}
}  // namespace

void measure(Core& core, Host& host, Master& master, Random& random, int accesses) {
  host.hurry();
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  const auto period = static_cast<double>(core.period());
  for (bool frames : {false, true}) {
    master.run(frames);
    for (bool write : {false, true})
      for (unsigned bytes : {1u, 2u, 4u, kBlock}) {
        const Figure f = figure(core, host, random, write, bytes, accesses);
        rows.push_back({{"frames", frames},
                        {"access", write ? "write" : "read"},
                        {"bytes", bytes},
                        {"meanCycles", f.mean / period},
                        {"worstCycles", f.worst / period},
                        {"meanNs", f.mean / 1000},
                        {"worstNs", f.worst / 1000},
                        {"mbytePerS", bytes * 1e6 / f.mean}});
      }
  }
  const nlohmann::ordered_json all = {{"preset", core.info().name},
                                      {"hostInterface", core.parameter("hostInterface")},
                                      {"dataBusWidth", core.info().dataBusWidth},
                                      {"coreClockMhz", core.info().coreClockMhz},
                                      {"accesses", accesses},
                                      {"figures", rows}};
  std::printf("%s\n", all.dump(1).c_str());
}

}  // namespace hosts
