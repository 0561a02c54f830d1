#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "learner/study/study_error.h"
#include "learner/study/study_store.h"

namespace treeroll {

/// The form of resolved studies. 1 is that of version 0.1.0, which did not say so: it had the paths
/// of CSV demonstrations, and the settings of tasks as they were given. Fits of 1 and 2 are not
/// refined unless a study says so.
inline constexpr int kStudyFormat = 3;

/// A study with every setting resolved, as study.toml of a state directory: a study file that loads
/// to an equal study, on any machine and without any other file.
struct ResolvedStudy {
  std::shared_ptr<nlohmann::json> study;                    ///< [study]
  std::vector<std::shared_ptr<nlohmann::json>> conditions;  ///< each with its tables
  StudyStore store;

  /// Throws ConfigError if it is more than a study file may hold.
  /// @param program  version of the program that writes it; may be empty
  std::string to_toml(const std::string& program) const;
};

/// How much of a study file something takes.
struct StudyBytes {
  std::size_t bare = 0;  ///< without what multi-line strings hold: kStudyBytesMax
  std::size_t all = 0;   ///< kStudyFileBytesMax
};
/// Adds what a condition takes in to_toml(). Throws ConfigError if that is more than a study file
/// may hold.
void add_condition_bytes(const nlohmann::json& condition, StudyBytes& bytes);

/// Throws StudyError on a study that was written in a later form than this program knows. To be
/// asked first: nothing else that is found in such a study says what is wrong.
void refuse_later_form(const nlohmann::json& document, const SettingOrigins& origins);

/// The name of the study in a file, whatever else it holds. Throws StudyError as read_toml_file()
/// does, and for a later form.
std::string read_study_name(const std::filesystem::path& study_file);

}  // namespace treeroll
