// A mistake of the user, told in one sentence; the programs print it and exit with code 2.
#pragma once

#include <stdexcept>

struct UserError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
