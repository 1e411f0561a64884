// What main() of every program shares.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <string>

// A whole number that needs more than 32 bits. CLI11 itself takes -1 as the highest one.
inline CLI::Range wholeNumber() { return {int64_t{0}, int64_t{1'000'000'000'000'000'000}}; }

// Beside CLI::Range, in which CLI11 finds NaN.
inline std::string isNumber(const std::string& text) {
  return text.find_first_not_of("0123456789.eE+-") == std::string::npos ? "" : "'" + text + "' is no number";
}

// Parses the command line and runs `body` (which returns the exit code); every mistake becomes one sentence
// and exit code 2.
template <class Body>
int runProgram(CLI::App& app, int argc, char** argv, Body body) {
  try {
    app.parse(argc, argv);
    return body();
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // --help
    std::fprintf(stderr, "%s: %s (see --help)\n", app.get_name().c_str(), e.what());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), e.what());
  }
  return 2;
}
