#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "learner/study/study_error.h"

namespace treeroll {

/// A study file and the overrides of the command line as settings by condition, before anything is
/// known about what they mean. The conditions are the file's, in its order, each with every value
/// of every axis, the last axis running fastest. What wins, from the weakest: the file's own
/// tables, a condition's, an axis's, the command line's.
class StudyDocument {
 public:
  /// @param overrides  "KEY=VALUE" each, the later ones winning
  /// Throws StudyError on a file that cannot be read or is of a later form; on unknown keys outside
  /// the four tables; on names that are empty, too long, not unique or not usable in file names; on
  /// no conditions or more than 1000; on an override of a key that an axis varies, for the names
  /// would lie.
  StudyDocument(const std::filesystem::path& file, const std::vector<std::string>& overrides);
  ~StudyDocument();
  StudyDocument(const StudyDocument&) = delete;
  StudyDocument& operator=(const StudyDocument&) = delete;

  /// Of the file itself, with plain line ends.
  const std::string& text() const { return text_; }

  std::size_t num_conditions() const { return names_.size(); }
  const std::string& name(std::size_t condition) const { return names_[condition]; }

  /// What a resolved study holds of its start policies beside its settings: the tables
  /// demonstrations and starts (see StudyStore) and written_by, as far as they are there.
  const nlohmann::json& attached() const;
  /// Where they stand.
  const SettingOrigins& attached_origins() const;

  /// @param settings  set to an object of the tables study, task, policy and exploration
  /// @return          where each of its keys stands
  SettingOrigins settings(std::size_t condition, nlohmann::json& settings) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::string text_;
  std::vector<std::string> names_;
};

}  // namespace treeroll
