#pragma once

#include <map>
#include <string>

#include "common/base/bad_input.h"
#include "common/base/config_error.h"

namespace treeroll {

/// A study that cannot be used: what() is one line for a person, "FILE:LINE: KEY = VALUE: RULE",
/// or "--set: KEY = VALUE: RULE" for a setting of the command line; parts that do not exist are
/// left out. Control characters of the file are shown as '?'.
class StudyError : public BadInput {
 public:
  /// @param location  "FILE:LINE", "FILE" or "--set"
  StudyError(const std::string& location, const ConfigError& error);
};

/// Where the settings of a study stand: dotted key ("policy.model", "conditions[0].name") ->
/// location of a StudyError. The empty key stands for the whole file.
using SettingOrigins = std::map<std::string, std::string, std::less<>>;

/// Where a setting of the command line stands.
inline constexpr const char* kCommandLineOrigin = "--set";

/// Of the key itself or, if it stands nowhere (a missing one), of the table it belongs to.
std::string origin_of(const SettingOrigins& origins, std::string key);

}  // namespace treeroll
