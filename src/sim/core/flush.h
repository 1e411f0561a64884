// Recordings are whole up to their last record.
#pragma once

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "core/user_error.h"

// UserError if something of the file could not be written; `what`: such as the log 'x'.
inline void flush(std::FILE* file, const std::string& what) {
  if (std::fflush(file) != 0 || std::ferror(file))
    throw UserError("cannot write " + what + ": " + std::strerror(errno) + ".");
}
