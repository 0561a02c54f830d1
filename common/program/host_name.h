#pragma once

#include <string>
#include <string_view>

namespace treeroll {

/// What this host calls itself (uname), as logs and tables show it: readable().
std::string host_name();

/// A name that the kernel takes as any bytes, as a message and a table may hold it: what is no
/// visible ASCII character is "?". Learners refuse messages with text that is not UTF-8.
std::string readable(std::string_view name);

}  // namespace treeroll
