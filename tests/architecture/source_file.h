#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace treeroll::architecture {

/// An #include directive.
struct Include {
  int line = 0;          ///< from 1
  bool quoted = false;   ///< "common/base/check.h", not <vector>
  std::string included;  ///< what stands between the quotes or brackets
};

/// A file as the rules see it.
struct SourceFile {
  std::string path;                ///< from the root of the tree, with '/'
  std::vector<std::string> lines;  ///< as they stand in the file
  std::vector<std::string> code;   ///< the same with comments and literals blanked (C++ only)
  std::vector<Include> includes;   ///< C++ only

  bool is_header() const { return path.ends_with(".h"); }
  bool is_cxx() const { return is_header() || path.ends_with(".cc"); }
  bool is_cmake() const { return path.ends_with("CMakeLists.txt") || path.ends_with(".cmake"); }
};

SourceFile make_source_file(std::string path, std::string_view text);

/// Every text file of the project below `root`: the rooms, tests and deploy, and the files that lie
/// at the top. Build folders, results and the version control's own files are not entered. Sorted
/// by path, so that findings come in the same order everywhere.
std::vector<SourceFile> read_tree(const std::filesystem::path& root);

/// The file at that path, which must be there.
const SourceFile& file_of(const std::vector<SourceFile>& tree, const std::string& path);

}  // namespace treeroll::architecture
