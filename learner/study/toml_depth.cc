#include "learner/study/toml_depth.h"

#include <algorithm>
#include <cstddef>

namespace treeroll {
namespace {

/// Index behind the string that begins at `begin` with a quote. A string that is not closed ends
/// with its line, or with the text if it is a multi-line one: toml++ will say so.
std::size_t skip_string(std::string_view toml, std::size_t begin) {
  const char quote = toml[begin];
  const bool escapes = quote == '"';
  const bool multi_line = toml.substr(begin, 3) == std::string_view(escapes ? "\"\"\"" : "'''");
  std::size_t i = begin + (multi_line ? 3 : 1);
  for (; i < toml.size(); ++i) {
    if (escapes && toml[i] == '\\') {
      ++i;
    } else if (!multi_line && (toml[i] == quote || toml[i] == '\n')) {
      return toml[i] == quote ? i + 1 : i;
    } else if (multi_line && toml[i] == quote && toml.substr(i, 3) == toml.substr(begin, 3)) {
      i += 3;
      // Up to two quotes may stand right before the closing three.
      for (int extra = 0; extra < 2 && i < toml.size() && toml[i] == quote; ++extra) ++i;
      return i;
    }
  }
  return toml.size();
}

/// Goes through a text outside of its strings and comments.
/// @param on_string     what is skipped, quotes included
/// @param on_character  gets the place of each other one; false ends the walk
template <class OnString, class OnCharacter>
void walk(std::string_view toml, OnString on_string, OnCharacter on_character) {
  std::size_t i = 0;
  while (i < toml.size()) {
    const char c = toml[i];
    if (c == '"' || c == '\'') {
      const std::size_t end = skip_string(toml, i);
      on_string(toml.substr(i, end - i));
      i = end;
    } else if (c == '#') {
      i = std::min(toml.find('\n', i), toml.size());
    } else if (!on_character(i++)) {
      return;
    }
  }
}

}  // namespace

int first_line_too_deep(std::string_view toml) {
  std::ptrdiff_t brackets = 0;
  int dots = 0;
  int line = 0;
  const auto on_character = [&](std::size_t i) {
    const char c = toml[i];
    if (c == '[' || c == '{') ++brackets;
    if (c == ']' || c == '}') --brackets;
    if (c == '.') {
      ++dots;
    } else if (c == '\n' || c == ',' || c == '=' || c == '[' || c == '{') {
      dots = 0;
    }
    if (dots < kTomlDepthMax && brackets <= kTomlDepthMax) return true;
    line = 1 + static_cast<int>(
                   std::count(toml.begin(), toml.begin() + static_cast<std::ptrdiff_t>(i), '\n'));
    return false;
  };
  walk(
      toml, [](std::string_view) {}, on_character);
  return line;
}

std::size_t bytes_beside_long_strings(std::string_view toml) {
  constexpr std::size_t kQuotes = 6;
  std::size_t bytes = toml.size();
  const auto on_string = [&bytes](std::string_view text) {
    const bool is_long = text.starts_with("\"\"\"") || text.starts_with("'''");
    if (is_long && text.size() > kQuotes) bytes -= text.size() - kQuotes;
  };
  walk(toml, on_string, [](std::size_t) { return true; });
  return bytes;
}

}  // namespace treeroll
