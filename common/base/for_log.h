#pragma once

#include <string>
#include <string_view>

namespace treeroll {

/// A line of a program as a log may show it: one line, no character that a terminal would obey,
/// bounded.
std::string for_log(std::string_view line);

}  // namespace treeroll
