#pragma once

#include <nlohmann/json_fwd.hpp>

namespace treeroll {
class ConfigError;
}

namespace treeroll::worker {

/// Standard output for one JSON answer. While this exists, whatever a task prints there goes to
/// standard error, so that it cannot spoil the answer.
class JsonAnswer {
 public:
  /// Throws std::runtime_error if standard output cannot be set aside.
  JsonAnswer();
  ~JsonAnswer();
  JsonAnswer(const JsonAnswer&) = delete;
  JsonAnswer& operator=(const JsonAnswer&) = delete;

  /// Prints a line; text in it that is not UTF-8 is replaced.
  /// @return  exit status: 0, or 1 if it could not be written
  int give(const nlohmann::json& value) const;
  /// Prints {"error": {"key", "value", "rule"}}.
  /// @return  exit status 2
  int refuse(const ConfigError& error) const;

 private:
  int standard_output_ = -1;
};

}  // namespace treeroll::worker
