#pragma once

#include <string>

#include "common/base/bad_input.h"

namespace treeroll {

/// A setting that cannot be used. Thrown by whoever reads settings, caught in main, which knows
/// the file and the line and exits with status 2.
class ConfigError : public BadInput {
 public:
  /// @param key    dotted path of the setting, "exploration.gamma"; empty if it is the whole file
  /// @param value  what stands there, as text; empty if nothing does
  /// @param rule   what would be right: "must be greater than 0"
  ConfigError(std::string key, std::string value, std::string rule);

  const std::string& key() const { return key_; }
  const std::string& value() const { return value_; }
  const std::string& rule() const { return rule_; }

 private:
  std::string key_;
  std::string value_;
  std::string rule_;
};

}  // namespace treeroll
