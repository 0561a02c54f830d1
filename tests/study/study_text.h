#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "learner/study/study_error.h"
#include "tests/files/scratch_folder.h"

namespace treeroll::study_test {

inline void write(const std::filesystem::path& path, std::string_view text) {
  std::ofstream(path, std::ios::binary) << text;
}

/// A file study.toml with a text, gone at the end.
class StudyText {
 public:
  explicit StudyText(std::string_view text) { write(path_, text); }

  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& folder() const { return folder_.path(); }

  /// An error with the file's name as "FILE".
  std::string shortened(std::string error) const {
    const auto at = error.find(path_.string());
    if (at != std::string::npos) error.replace(at, path_.string().size(), "FILE");
    return error;
  }

 private:
  ScratchFolder folder_;
  std::filesystem::path path_ = folder_.path() / "study.toml";
};

/// What a StudyError thrown by `load(path)` says, "" if there was none.
template <class Load>
std::string error_of(const StudyText& file, Load load) {
  try {
    load(file.path());
  } catch (const StudyError& error) {
    return file.shortened(error.what());
  }
  return "";
}

}  // namespace treeroll::study_test
