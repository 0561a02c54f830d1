#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include "tests/architecture/source_file.h"

namespace treeroll::architecture {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr const char* kWhere = "deploy/doc/where.md";

/// A file, or a folder that holds one.
bool stands_in(const std::vector<SourceFile>& tree, std::string path) {
  if (path.ends_with('/')) path.pop_back();
  return std::any_of(tree.begin(), tree.end(), [&](const SourceFile& file) {
    return file.path == path || file.path.starts_with(path + '/');
  });
}

bool stands_in(const SourceFile& file, const std::string& name) {
  const std::regex word("\\b" + name + "\\b");
  return std::any_of(file.lines.begin(), file.lines.end(),
                     [&](const std::string& line) { return std::regex_search(line, word); });
}

/// What the page names and the tree does not have: paths in backquotes from the root, sources in
/// the folder named before them in the line, functions in parentheses behind their file, and links.
std::vector<std::string> missing(const SourceFile& page, const std::vector<SourceFile>& tree) {
  static const std::regex named(R"re((\()?`([\w./]+)`|\]\(([^)#:]+)(?:#[^)]*)?\))re");
  const std::filesystem::path folder_of_page = std::filesystem::path(page.path).parent_path();
  std::vector<std::string> gone;
  for (const std::string& line : page.lines) {
    std::string folder;
    std::string latest;  // the path named last
    for (std::sregex_iterator it(line.begin(), line.end(), named), end; it != end; ++it) {
      std::string path = (*it)[2];
      if ((*it)[3].matched) {
        path = (folder_of_page / (*it)[3].str()).lexically_normal().generic_string();
      } else if (path.find('/') == std::string::npos) {
        const bool is_source = path.ends_with(".cc") || path.ends_with(".h");
        if (is_source) {
          path = folder + path;
        } else {
          const bool belongs = (*it)[1].matched && !latest.empty() && stands_in(tree, latest);
          if (belongs && !stands_in(file_of(tree, latest), path)) {
            gone.push_back(path + " in " + latest);
          }
          continue;
        }
      }
      if (path.ends_with('/')) folder = path;
      latest = path.ends_with('/') ? "" : path;
      if (!stands_in(tree, path)) gone.push_back(path);
    }
  }
  return gone;
}

TEST(WhereTest, EveryFileThatThePageNamesIsThere) {
  const std::vector<SourceFile> tree = read_tree(TREEROLL_SOURCE_DIR);
  EXPECT_THAT(missing(file_of(tree, kWhere), tree), IsEmpty());
}

TEST(WhereTest, WhatIsGoneIsNamed) {
  const std::vector<SourceFile> tree{make_source_file("sim/plant.cc", "void simulate() {}\n"),
                                     make_source_file("README.md", "")};
  const auto of = [&](const std::string& row) {
    return missing(make_source_file(kWhere, row), tree);
  };
  EXPECT_THAT(of("| a plant | `sim/`, then `plant.cc` there, [more](../../README.md#rooms) |"),
              IsEmpty());
  EXPECT_THAT(of("| a plant | `sim/plant.cc` (`simulate`), of `runs.csv` |"), IsEmpty());
  EXPECT_THAT(of("| a plant | `sim/plants.cc` |"), ElementsAre("sim/plants.cc"));
  EXPECT_THAT(of("| a plant | `sims/`, `lant.cc` |"), ElementsAre("sims/", "sims/lant.cc"));
  EXPECT_THAT(of("| a plant | `sim/plant.cc` (`simulat`) |"),
              ElementsAre("simulat in sim/plant.cc"));
  EXPECT_THAT(of("[more](../README.md#rooms)"), ElementsAre("deploy/README.md"));
}

}  // namespace
}  // namespace treeroll::architecture
