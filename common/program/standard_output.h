#pragma once

namespace treeroll {

/// Throws std::runtime_error if what has been printed cannot be written, on a full disk say.
void flush_standard_output();

}  // namespace treeroll
