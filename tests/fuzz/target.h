#pragma once

#include <ostream>
#include <span>
#include <string>
#include <string_view>

namespace treeroll::fuzz {

/// A reader of what comes from outside, given any bytes: it takes them or refuses them with an
/// error of ours. Everything else - a signal, a sanitizer's finding, an exception of another kind,
/// a broken law - ends the process.
struct Target {
  const char* name;                     ///< also of its folder of seeds, corpus/NAME
  bool (*run)(std::string_view bytes);  ///< whether it took something
};

inline std::ostream& operator<<(std::ostream& out, const Target& target) {
  return out << target.name;
}

std::span<const Target> targets();
/// Ends the process with a word if there is none.
const Target& target(std::string_view name);

/// A law that what was taken keeps. Ends the process if it does not.
void require(bool holds, const char* law);

/// The file `path` of this process has these bytes, for readers that take a file alone.
std::string as_file(std::string_view bytes);

}  // namespace treeroll::fuzz
