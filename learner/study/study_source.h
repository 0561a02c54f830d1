#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "learner/study/study_error.h"

namespace treeroll {

/// Files a study may extend, one through the other.
inline constexpr int kExtendedFilesMax = 8;

/// Reads a study file and, below it, the one its key `extends` names (relative to its own folder):
/// tables are merged key by key, the extending file winning; a condition or an axis takes the place
/// of the extended file's one of the same name, others follow behind. Throws StudyError: see
/// read_toml_file; on more than kExtendedFilesMax files (two that extend each other, say).
/// @param content  set to the document, without `extends`
/// @param text     set to what was read of the file itself, with plain line ends; may be null
/// @return         where every key stands
SettingOrigins read_study_source(const std::filesystem::path& file, nlohmann::json& content,
                                 std::string* text = nullptr);

}  // namespace treeroll
