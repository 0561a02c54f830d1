#include "learner/study/study_error.h"

#include <string_view>

namespace treeroll {
namespace {

/// A key or value may hold anything TOML can escape, and the error goes to a terminal.
std::string printable(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return text;
}

}  // namespace

StudyError::StudyError(const std::string& location, const ConfigError& error)
    : BadInput(printable(location + ": " + error.what())) {}

std::string origin_of(const SettingOrigins& origins, std::string key) {
  for (;;) {
    const auto found = origins.find(key);
    if (found != origins.end()) return found->second;
    if (key.empty()) return "study";
    const auto end = key.find_last_of(".[");
    key.resize(end == std::string::npos ? 0 : end);
  }
}

}  // namespace treeroll
