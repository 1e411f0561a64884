#include <chrono>
#include <fstream>
#include <iostream>

#include "fuzz/fuzz.h"
#include "core/program.h"
#include "core/user_error.h"

int main(int argc, char** argv) {
  CLI::App app("Plays test vectors on one simulated slave and compares what it sends and holds.",
               "flyframe-fuzz");
  std::string preset, vectors;
  bool list = false;
  app.add_option("--preset", preset, "preset the vectors must be for (default: what their H line says)");
  app.add_option("--vectors", vectors, "vector file, - for standard input");
  app.add_flag("--list", list, "print the presets built in");
  return runProgram(app, argc, argv, [&]() -> int {
    if (list) return std::cout << presetNames() << "\n", 0;
    if (vectors.empty()) throw UserError("--vectors is missing.");
    if (!preset.empty()) findPreset(preset);
    std::ifstream file;
    if (vectors != "-") {
      file.open(vectors);
      if (!file) throw UserError("cannot read the vectors '" + vectors + "'.");
    }
    std::ios::sync_with_stdio(false);
    const auto start = std::chrono::steady_clock::now();
    Fuzz fuzz(preset);
    const bool same = fuzz.play(vectors == "-" ? std::cin : file);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!same) std::cout << fuzz.difference() << "\n";
    std::cout << "frames " << fuzz.frames() << ", differences " << (same ? 0 : 1) << ", bytes compared "
              << fuzz.bytesCompared() << ", speed " << static_cast<long>(fuzz.frames() / seconds)
              << " frames/s, " << static_cast<long>(fuzz.cycles() / seconds) << " core cycles/s\n";
    return same ? 0 : 1;
  });
}
