#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace treeroll {

/// What a worker executable has printed, a JSON object: it may be a user's, so nothing in it is
/// trusted. An answer {"error": {"key": .., "value": .., "rule": ..}} is thrown as the ConfigError
/// it stands for.
/// @param key_otherwise  of an error that names none
/// @param unusable       thrown as std::runtime_error for what is no object, nested too deeply, or
///                       has an error that is of another shape
nlohmann::json read_program_answer(const std::string& output, const std::string& key_otherwise,
                                   const std::string& unusable);

}  // namespace treeroll
