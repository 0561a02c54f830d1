#pragma once

#include <string_view>

namespace treeroll {

/// Ends the process with a message; for broken invariants of our own, never for bad input.
[[noreturn]] void check_failed(const char* file, int line, const char* condition,
                               std::string_view message);

}  // namespace treeroll

/// An invariant of our own code. Stays on in release: a wrong result is worse than a stop.
/// `message` is evaluated only on failure.
#define CHECK(condition, message)                                        \
  do {                                                                   \
    if (!(condition)) {                                                  \
      ::treeroll::check_failed(__FILE__, __LINE__, #condition, message); \
    }                                                                    \
  } while (false)
