#pragma once

namespace treeroll {

/// How many doubles this processor computes side by side, of the widths there are sources for: 8
/// (AVX-512), 4 (AVX2) or 2 (every x86-64). Results do not depend on it.
int widest_lanes();

}  // namespace treeroll
