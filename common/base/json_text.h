#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "common/base/result.h"

namespace treeroll {

/// Parses JSON without exceptions and without following its nesting deeper than `nesting_max`:
/// what walks or destroys a value does so by recursion, and a hostile text could exhaust the stack.
/// An error is a rule about the text: "must be JSON", "must not be nested deeper than 64".
Result<nlohmann::json> parse_json(std::string_view text, int nesting_max);

}  // namespace treeroll
