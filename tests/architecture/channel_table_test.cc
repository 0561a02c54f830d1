// The table of channels that people read is the one that the programs have.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include "tests/architecture/source_file.h"

namespace treeroll::architecture {
namespace {

/// Channel -> type, as wire_fields.h has them: a message's type stands before its channel.
std::map<std::string, std::string> in_code(const SourceFile& header) {
  const std::regex type(R"(using Wire = (\w+);)");
  const std::regex channel(R"re(kChannelName = "(\w+)";)re");
  std::map<std::string, std::string> types;
  std::string latest;
  for (const std::string& line : header.lines) {
    std::smatch match;
    if (std::regex_search(line, match, type)) latest = match[1];
    if (std::regex_search(line, match, channel)) types[match[1]] = latest;
  }
  return types;
}

std::map<std::string, std::string> in_table(const SourceFile& readme) {
  const std::regex row(R"(^\| `(TREEROLL_\w+)` \| `(\w+)` \|.*)");
  std::map<std::string, std::string> types;
  for (const std::string& line : readme.lines) {
    if (std::smatch match; std::regex_match(line, match, row)) types[match[1]] = match[2];
  }
  return types;
}

TEST(ChannelTableTest, HasEachChannelWithItsTypeAndNothingElse) {
  const std::vector<SourceFile> tree = read_tree(TREEROLL_SOURCE_DIR);
  const auto types = in_code(file_of(tree, "common/transport/wire_fields.h"));
  EXPECT_GE(types.size(), 9U) << "wire_fields.h was not read";
  EXPECT_EQ(in_table(file_of(tree, "lcmtypes/README.md")), types);
}

}  // namespace
}  // namespace treeroll::architecture
