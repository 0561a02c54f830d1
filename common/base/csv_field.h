#pragma once

#include <string>
#include <string_view>

namespace treeroll {

/// One field, in quotes if it holds a comma, a quote or a line break.
std::string csv_field(std::string_view text);

}  // namespace treeroll
