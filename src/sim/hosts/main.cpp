#include <cinttypes>
#include <iostream>

#include "core/program.h"
#include "core/user_error.h"
#include "hosts/measure.h"
#include "hosts/suite.h"

int main(int argc, char** argv) {
  CLI::App app(
      "A host at the pins of a simulated slave, as its interface has them: what the driver needs, "
      "and accesses that a host must not make.",
      "flyframe-hosts");
  std::string preset, registers;
  int rounds = 50, measured = 0;
  bool list = false;
  uint64_t accesses = 10000, seed = 1;
  app.add_option("--preset", preset, "preset with hostInterface 0 to 5 and 4 SyncManagers");
  app.add_option("--registers", registers, "its C header");
  app.add_option("--rounds", rounds, "messages and buffers each way")->capture_default_str();
  app.add_option("--accesses", accesses, "at random, good and bad")->capture_default_str();
  app.add_option("--seed", seed, "of the random numbers")->capture_default_str();
  app.add_option("--measure", measured,
                 "accesses of each kind to measure, printed as JSON, and nothing else");
  app.add_flag("--list", list, "print the presets built in");
  return runProgram(app, argc, argv, [&]() -> int {
    if (list) return std::cout << presetNames() << "\n", 0;
    hosts::Core core(findPreset(preset));
    hosts::Random random(seed);
    std::string phase = "conformance";
    try {
      const auto host = hosts::makeHost(core, random);
      hosts::Master master(core, random);
      hosts::Suite suite(core, *host, master, random);
      if (measured > 0) {
        phase = "measurement";
        suite.switchOn();
        hosts::measure(core, *host, master, random, measured);
        return 0;
      }
      suite.run(hosts::registersOf(registers), rounds);
      phase = "random accesses";
      hosts::Storm storm(core, *host, master, random);
      storm.run(accesses);
      // Afterwards everything works as before.
      phase = "conformance behind them";
      storm.print();
      suite.run(hosts::registersOf(registers), rounds);
      std::printf("%s: conformant; %" PRIu64 " accesses at random; %" PRIu64 " frames beside them; %" PRIu64
                  " core cycles; seed %" PRIu64 "\n",
                  preset.c_str(), accesses, master.frames(), core.cycles(), seed);
      return 0;
    } catch (const hosts::Wrong& wrong) {
      std::printf("WRONG: %s, %s: %s; core cycle %" PRIu64 ", seed %" PRIu64 "\n", preset.c_str(),
                  phase.c_str(), wrong.what(), core.cycles(), seed);
      return 1;
    }
  });
}
