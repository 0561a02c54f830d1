#pragma once

namespace treeroll {

/// The source this was built from: "commit 1a2b3c4d5e6f"; ", changed" behind it if files differed
/// from it; "commit unknown" for a source tree without its repository.
const char* build_id();

}  // namespace treeroll
