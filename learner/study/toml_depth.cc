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

}  // namespace

int first_line_too_deep(std::string_view toml) {
  std::ptrdiff_t brackets = 0;
  int dots = 0;
  std::size_t i = 0;
  while (i < toml.size()) {
    const char c = toml[i];
    if (c == '"' || c == '\'') {
      i = skip_string(toml, i);
      continue;
    }
    if (c == '#') {
      i = std::min(toml.find('\n', i), toml.size());
      continue;
    }
    if (c == '[' || c == '{') ++brackets;
    if (c == ']' || c == '}') --brackets;
    if (c == '.') {
      ++dots;
    } else if (c == '\n' || c == ',' || c == '=' || c == '[' || c == '{') {
      dots = 0;
    }
    if (dots >= kTomlDepthMax || brackets > kTomlDepthMax) {
      return 1 + static_cast<int>(std::count(toml.begin(), toml.begin() + i, '\n'));
    }
    ++i;
  }
  return 0;
}

}  // namespace treeroll
