#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "learner/study/study_error.h"

namespace treeroll {

/// Most that is read of a study file but for what its multi-line strings hold: a parser makes much
/// of little there. And most that is read in all: a resolved study holds its demonstrations.
inline constexpr std::size_t kStudyBytesMax = std::size_t{1} << 20;
inline constexpr std::size_t kStudyFileBytesMax = std::size_t{32} << 20;

/// Reads a TOML file into JSON: tables become objects; integers and floats stay apart. Refused with
/// a StudyError: what is not a regular, readable file of 1 to kStudyBytesMax bytes, and
/// kStudyFileBytesMax with its multi-line strings (a folder would parse as an empty document);
/// every error of syntax, with line and column; and what a setting cannot hold: dates, inf, nan,
/// NUL characters, tables in tables beyond a depth of 32.
/// @param content  set to the document
/// @param least    what it must hold, for the error of an empty one
/// @param text     set to what was read, with plain line ends; may be null
/// @return         line of every key
SettingOrigins read_toml_file(const std::filesystem::path& path, nlohmann::json& content,
                              std::string_view least, std::string* text = nullptr);

/// A setting of the command line.
struct SettingOverride {
  std::vector<std::string> key;  ///< "study.rollouts" -> {"study", "rollouts"}
  std::string text;              ///< "50"
};

/// Splits "KEY=VALUE", KEY a dotted path of letters, digits, '_' and '-'. Throws StudyError.
SettingOverride parse_override(const std::string& argument);

/// VALUE as TOML; a bare word that is no TOML value is a string. Throws StudyError.
void parse_override_value(const SettingOverride& setting, nlohmann::json& value);

/// A document of tables, as TOML that reads back to the same: keys sorted, floats in their shortest
/// exact form and always with a point or an exponent; a long string stands on lines of its own.
/// @param table    an object of scalars, arrays and objects, without null
/// @param heading  dotted path of the table, "" for the document itself
void append_toml(const nlohmann::json& table, const std::string& heading, std::string& text);

}  // namespace treeroll
