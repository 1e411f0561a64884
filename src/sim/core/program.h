// What main() of every program shares.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>

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
