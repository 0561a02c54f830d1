#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/architecture/equation_map.h"
#include "tests/architecture/rooms.h"
#include "tests/architecture/rules.h"
#include "tests/architecture/source_file.h"

namespace treeroll::architecture {
namespace {

const std::vector<SourceFile>& tree() {
  static const std::vector<SourceFile> files = read_tree(TREEROLL_SOURCE_DIR);
  return files;
}

TEST(ArchitectureTest, NoRuleIsBrokenInTheTree) {
  for (const Finding& finding : check_tree(tree())) ADD_FAILURE() << to_string(finding);
}

TEST(ArchitectureTest, EveryArrowBetweenRoomsIsUsed) {
  for (const Finding& finding : check_unused_arrows(tree())) ADD_FAILURE() << to_string(finding);
}

TEST(ArchitectureTest, TheMapOfTheThesissEquationsIsTrueAndWhole) {
  for (const Finding& finding : check_equation_map(tree())) ADD_FAILURE() << to_string(finding);
}

// Guards the tests above against looking at nothing.
TEST(ArchitectureTest, TheTreeWasRead) {
  const auto has = [](const std::string& path) {
    return std::any_of(tree().begin(), tree().end(), [&](const SourceFile& file) {
      return file.path == path && !file.lines.empty();
    });
  };
  EXPECT_TRUE(has("CMakeLists.txt"));
  EXPECT_TRUE(has("common/base/check.h"));
  EXPECT_TRUE(has("common/settings/settings_reader.cc"));
  EXPECT_TRUE(has("learner/core/study.h"));
  EXPECT_TRUE(has("deploy/test"));
  EXPECT_TRUE(has(std::string(kEquationMapPath)));
  EXPECT_TRUE(has("tests/architecture/architecture_test.cc"));
}

TEST(ArchitectureTest, EverySourceOutsideTheTestsLiesInARoom) {
  for (const SourceFile& file : tree()) {
    if (!file.is_cxx() || file.path.starts_with("tests/")) continue;
    EXPECT_NE(room_of(file.path), "") << file.path << ": add its folder to rooms.cc";
  }
}

TEST(RoomsTest, ArrowsLeadToRoomsAndNeverInACircle) {
  for (const auto& [name, room] : rooms()) {
    for (const std::string& next : room.arrows) {
      ASSERT_TRUE(rooms().contains(next)) << name << " -> " << next;
      EXPECT_FALSE(reachable(next).contains(name)) << name << " -> " << next << " -> " << name;
    }
  }
}

TEST(RoomsTest, LearnerAndWorkersNeverIncludeEachOther) {
  for (const auto& [name, room] : rooms()) {
    if (name.starts_with("workers/relay")) continue;  // a worker upwards, a learner downwards
    for (const std::string& next : reachable(name)) {
      EXPECT_FALSE(name.starts_with("learner/") && next.starts_with("workers/")) << name;
      EXPECT_FALSE(name.starts_with("workers/") && next.starts_with("learner/")) << name;
      EXPECT_FALSE(name.starts_with("learner/") && next == "sim") << name;
    }
  }
}

TEST(RoomsTest, ACoreReachesOnlyCores) {
  for (const auto& [name, room] : rooms()) {
    if (!room.is_core) continue;
    for (const std::string& next : reachable(name)) {
      EXPECT_TRUE(rooms().at(next).is_core) << name << " -> " << next;
    }
  }
}

}  // namespace
}  // namespace treeroll::architecture
