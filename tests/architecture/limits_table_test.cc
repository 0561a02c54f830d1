// Every bound of the service is explained, and the test that is to show it exists.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/architecture/source_file.h"

namespace treeroll::architecture {
namespace {

/// The names in limits.h.
std::set<std::string> limits(const SourceFile& header) {
  std::set<std::string> names;
  const std::regex constant(R"(inline constexpr [\w:]+ (k\w+) =)");
  for (const std::string& line : header.code) {
    if (std::smatch match; std::regex_search(line, match, constant)) names.insert(match[1]);
  }
  return names;
}

/// The rows of the table: limit -> "Suite.Name".
std::map<std::string, std::string> rows(const SourceFile& readme) {
  std::map<std::string, std::string> tests;
  const std::regex row(R"(^\| `(k\w+)` \| [^|]+ \| [^|]+ \| `(\w+\.\w+)` \|$)");
  for (const std::string& line : readme.lines) {
    if (std::smatch match; std::regex_match(line, match, row)) tests[match[1]] = match[2];
  }
  return tests;
}

/// "Suite.Name" of each test in the tree.
std::set<std::string> tests(const std::vector<SourceFile>& tree) {
  std::set<std::string> names;
  const std::regex test(R"(^TEST(?:_F|_P)?\((\w+), (\w+)\))");
  for (const SourceFile& file : tree) {
    if (!file.path.starts_with("tests/") || !file.is_cxx()) continue;
    for (const std::string& line : file.lines) {
      if (!line.starts_with("TEST")) continue;
      if (std::smatch match; std::regex_search(line, match, test)) {
        names.insert(match[1].str() + "." + match[2].str());
      }
    }
  }
  return names;
}

TEST(LimitsTableTest, HasEachLimitWithATestThatExistsAndNothingElse) {
  const std::vector<SourceFile> tree = read_tree(TREEROLL_SOURCE_DIR);
  const std::set<std::string> names = limits(file_of(tree, "common/protocol/limits.h"));
  const std::map<std::string, std::string> table = rows(file_of(tree, "common/protocol/README.md"));
  const std::set<std::string> existing = tests(tree);
  EXPECT_GE(names.size(), 35U) << "limits.h was not read";
  for (const std::string& name : names) {
    EXPECT_TRUE(table.contains(name)) << name << ": a row in common/protocol/README.md, please";
  }
  for (const auto& [name, test] : table) {
    EXPECT_TRUE(names.contains(name)) << name << " is in no limits.h";
    EXPECT_TRUE(existing.contains(test)) << name << ": there is no test " << test;
  }
}

}  // namespace
}  // namespace treeroll::architecture
