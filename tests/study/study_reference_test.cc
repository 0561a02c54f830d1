// The reference of a study's keys: complete, and with a meaning for each.
#include "learner/study/study_reference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "learner/study/study_file.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

const std::vector<StudyTableReference>& reference() {
  static const std::vector<StudyTableReference> tables = study_reference();
  return tables;
}

std::set<std::string> listed() {
  std::set<std::string> keys;
  for (const StudyTableReference& table : reference()) {
    for (const ListedKey& key : table.keys.keys) keys.insert(key.note.key);
  }
  return keys;
}

void add_keys(const json& table, const std::string& path, std::set<std::string>& keys) {
  for (const auto& [key, value] : table.items()) {
    if (value.is_object()) {
      add_keys(value, path + "." + key, keys);
    } else {
      keys.insert(std::regex_replace(path + "." + key, std::regex(R"(_\d+\.)"), "_N."));
    }
  }
}

TEST(StudyReferenceTest, EveryKeyHasAMeaning) {
  for (const StudyTableReference& table : reference()) {
    EXPECT_FALSE(table.keys.keys.empty()) << table.heading;
    for (const ListedKey& key : table.keys.keys) EXPECT_NE(key.note.meaning, "") << key.note.key;
  }
}

TEST(StudyReferenceTest, EveryKeyOfEveryShippedStudyIsListed) {
  const std::set<std::string> known = listed();
  std::size_t num_studies = 0;
  for (const auto& file : std::filesystem::directory_iterator(TREEROLL_STUDIES_DIR)) {
    if (file.path().extension() != ".toml") continue;
    ++num_studies;
    const LoadedStudy loaded = load_study(file.path(), {});
    std::set<std::string> keys;
    add_keys(*loaded.resolved.study, "study", keys);
    for (const auto& condition : loaded.resolved.conditions) {
      for (const char* table : {"study", "policy", "exploration"}) {
        add_keys(condition->at(table), table, keys);
      }
    }
    for (const std::string& key : keys) {
      EXPECT_TRUE(known.contains(key)) << file.path() << ": " << key;
    }
  }
  EXPECT_GE(num_studies, 16u);
}

/// Under which other keys one is asked for that has this default.
std::vector<std::string> listed_conditions(const std::string& key, const std::string& otherwise) {
  for (const StudyTableReference& table : reference()) {
    for (const ListedKey& listed : table.keys.keys) {
      if (listed.note.key == key && listed.note.otherwise == otherwise) return listed.conditions;
    }
  }
  return {"not listed"};
}

/// Kind "auto" asks for the keys of the kind that it comes to, and two kinds ask for one key beside
/// another start.
TEST(StudyReferenceTest, SaysOfEveryKindThatTakesAKey) {
  const std::string from_nothing = "`policy.start = \"constant\"`";
  EXPECT_THAT(listed_conditions("policy.hidden", "5"),
              ElementsAre("`policy.kind = \"auto\"` or `\"network\"`"));
  EXPECT_THAT(listed_conditions("policy.seed", "1"),
              ElementsAre("`policy.kind = \"auto\"` or `\"network\"`"));
  EXPECT_THAT(listed_conditions("policy.coefficients", "[8] of degree 3; of others as many spans"),
              ElementsAre("`policy.kind = \"auto\"` or `\"correction\"`"));
  EXPECT_THAT(listed_conditions("policy.coefficients",
                                "[4, 5, 7, 11] of degree 3; of others as many spans"),
              ElementsAre("`policy.kind = \"spline\"`", from_nothing));
  EXPECT_THAT(listed_conditions("policy.functions", "8"),
              ElementsAre("`policy.kind = \"rbf\"`", from_nothing));
  EXPECT_THAT(listed_conditions("policy.range", ""),
              ElementsAre("`policy.kind = \"auto\"` or `\"dmp\"` or `\"ds_gmr\"` or `\"rbf\"` or "
                          "`\"spline\"`",
                          "`policy.start = \"components\"` or `\"constant\"`"));
}

/// What the reference tried in vain: what is behind such a refusal could hide a key.
TEST(StudyReferenceTest, OnlyWhatNeedsMoreThanOneKeyIsRefused) {
  std::set<std::string> refused;
  for (const StudyTableReference& table : reference()) {
    for (const std::string& text : table.keys.refused) {
      refused.insert(text.substr(0, text.find(": ")));
    }
  }
  const std::string csv = "policy.demonstration.kind = \"csv\"";
  EXPECT_THAT(refused,
              UnorderedElementsAre(
                  // Several files are aligned, and the reference has one.
                  "policy.demonstration.align = \"duration\", " + csv,
                  "policy.demonstration.align = \"dynamic_time_warping\", " + csv,
                  // No data have the content of the example. What would follow follows without it.
                  csv + ", policy.demonstration.content",
                  csv + ", policy.demonstration.content, policy.demonstration.files"));
}

}  // namespace
}  // namespace treeroll
