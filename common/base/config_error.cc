#include "common/base/config_error.h"

#include <utility>

namespace treeroll {
namespace {

std::string describe(const std::string& key, const std::string& value, const std::string& rule) {
  std::string text = key;
  if (!value.empty()) text += (text.empty() ? "" : " = ") + value;
  return text.empty() ? rule : text + ": " + rule;
}

}  // namespace

ConfigError::ConfigError(std::string key, std::string value, std::string rule)
    : BadInput(describe(key, value, rule)),
      key_(std::move(key)),
      value_(std::move(value)),
      rule_(std::move(rule)) {}

}  // namespace treeroll
