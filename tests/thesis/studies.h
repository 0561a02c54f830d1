#pragma once

#include <filesystem>

namespace treeroll {

/// The shipped studies.
inline const std::filesystem::path kStudies = TREEROLL_STUDIES_DIR;

}  // namespace treeroll
