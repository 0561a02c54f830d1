#pragma once

#include <string>

namespace treeroll::worker {

/// Names what the last bits of a simulation depend on: architecture, the processor features by
/// which the C library chooses its variants, and that library's version.
std::string numeric_class();

}  // namespace treeroll::worker
