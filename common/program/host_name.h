#pragma once

#include <string>

namespace treeroll {

/// What this host calls itself (uname).
std::string host_name();

}  // namespace treeroll
