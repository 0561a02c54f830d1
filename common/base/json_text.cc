#include "common/base/json_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace treeroll {

Result<nlohmann::json> parse_json(std::string_view text, int nesting_max) {
  using nlohmann::json;
  bool too_deep = false;
  const json::parser_callback_t guard = [&](int depth, json::parse_event_t, json&) {
    too_deep = too_deep || depth > nesting_max;
    return !too_deep;
  };
  json value = json::parse(text, guard, /*allow_exceptions=*/false);
  if (too_deep) return Error{fmt::format("must not be nested deeper than {}", nesting_max)};
  if (value.is_discarded()) return Error{"must be JSON"};
  return value;
}

}  // namespace treeroll
