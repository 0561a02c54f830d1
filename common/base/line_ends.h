#pragma once

#include <string>

namespace treeroll {

/// A text whose lines end with "\n" where they ended with "\r\n": files that pass through other
/// systems come back so, and mean the same.
std::string with_plain_line_ends(std::string text);

}  // namespace treeroll
