#include "learner/report/claims_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "learner/study/study_error.h"
#include "learner/study/study_file.h"
#include "tests/files/scratch_folder.h"

namespace treeroll::report {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class ClaimsFileTest : public testing::Test {
 protected:
  std::vector<Claim> read(const std::string& text) const {
    std::ofstream(folder_ / "claims.toml") << text;
    return read_claims(folder_ / "claims.toml");
  }
  std::string error(const std::string& text) const {
    try {
      (void)read(text);
    } catch (const StudyError& error) {
      return error.what();
    }
    return "read without an error";
  }

  static constexpr const char* kClaim = R"([[claims]]
text = "a rises"
section = "4-1-2"
study = "s"
kind = "greater"
conditions = ["a", "b"]
rollout = 50
)";
  ScratchFolder scratch_;
  std::filesystem::path folder_ = scratch_.path();
};

TEST_F(ClaimsFileTest, OneClaimStandsForEachWord) {
  std::string claim = kClaim;
  claim.replace(claim.find("a rises"), 7, "{} rises");
  claim.replace(claim.find("[\"a\", \"b\"]"), 10, "[\"{}.a\", \"{}.b\"]");
  const auto claims = read(claim + "each = [\"x\", \"y\"]\n");
  ASSERT_EQ(claims.size(), 2U);
  EXPECT_EQ(claims[1].text, "y rises");
  EXPECT_EQ(claims[1].conditions, (std::vector<std::string>{"y.a", "y.b"}));
  EXPECT_EQ(claims[1].measure.rollout, 50);
  EXPECT_EQ(claims[1].against.rollout, 50);
}

TEST_F(ClaimsFileTest, APlaceForAWordNeedsWords) {
  const auto without_words = [&](const std::string& from, const std::string& to) {
    std::string claim = kClaim;
    claim.replace(claim.find("greater"), 7, "spread");
    claim += "others = [\"c\", \"d\"]\nfigure = \"switches\"\n";
    return error(claim.replace(claim.find(from), from.size(), to));
  };
  const std::string rule = ": has {}, for which each must list words";
  EXPECT_THAT(without_words("a rises", "{} rises"),
              HasSubstr("claims.toml:2: claims[0].text = \"{} rises\"" + rule));
  EXPECT_THAT(without_words("\"b\"", "\"{}.b\""), HasSubstr("claims[0].conditions"));
  EXPECT_THAT(without_words("\"d\"", "\"{}.b\""), HasSubstr("claims[0].others"));
  EXPECT_THAT(without_words("switches", "{}"), HasSubstr("claims[0].figure = \"{}\"" + rule));
  EXPECT_EQ(without_words("a rises", "a falls"), "read without an error");
}

TEST_F(ClaimsFileTest, AMarginIsSignedOnlyWhereTheFirstIsClaimedToBeGreater) {
  std::string claim = kClaim;
  EXPECT_EQ(read(claim)[0].margin, 0);
  EXPECT_EQ(read(claim + "margin = -0.05\n")[0].margin, -.05);
  claim.replace(claim.find("greater"), 7, "highest");
  EXPECT_EQ(read(claim + "margin = 0.1\n")[0].margin, .1);
  EXPECT_THAT(error(claim + "margin = -0.1\n"), HasSubstr("claims[0].margin = -0.1"));
}

TEST_F(ClaimsFileTest, SpreadIsOverEquallyManyConditions) {
  std::string claim = kClaim;
  claim.replace(claim.find("greater"), 7, "spread");
  EXPECT_EQ(read(claim + "others = [\"c\", \"d\"]\n")[0].others.size(), 2U);
  for (const char* others : {R"(["c"])", R"(["c", "d", "e"])"}) {
    EXPECT_THAT(error(claim + "others = " + others + "\n"),
                AllOf(HasSubstr("claims.toml:8: claims[0].others = "),
                      HasSubstr("must be 2, as many as conditions")));
  }
}

TEST_F(ClaimsFileTest, RefusalsNameFileLineKeyValueAndRule) {
  const std::string good = kClaim;
  EXPECT_THAT(error(good + "share_max = 1.0\n"), HasSubstr("claims.toml:8: claims[0].share_max"));
  EXPECT_THAT(error(good + "measure = \"end\"\n"), HasSubstr("claims[0].measure"));
  EXPECT_THAT(error(good + "measure = \"mean\"\nfrom = 51\n"), HasSubstr("claims[0].from = 51"));
  EXPECT_THAT(error(good + "against = {measure = \"near\", rollout = 4}\n"),
              HasSubstr("claims[0].against.rollout = 4: must be at least 5"));
  EXPECT_THAT(error(good + "measure = \"steepest\"\n"), HasSubstr("claims[0].rollout = 50"));
  EXPECT_THAT(error(good + "against = {measure = \"gain\", rollout = 4}\n"),
              HasSubstr("claims[0].against.rollout = 4: must be at least 5"));
  EXPECT_THAT(error("[[claims]]\ntext = \"a\"\n"), HasSubstr("claims[0].section"));
  EXPECT_THAT(error("[study]\nname = \"a\"\n"), HasSubstr("holds [[claims]] and nothing else"));
  EXPECT_THAT(error(""), HasSubstr("claims.toml: is empty: must hold at least one of [[claims]]"));
  EXPECT_THAT(error("claims = []\n"), HasSubstr("holds [[claims]] and nothing else"));
  EXPECT_THAT(error(good + "each = []\n"),
              HasSubstr("claims.toml:8: claims[0].each = []: must be a list of 1 to 100 strings"));
  std::string three = good;
  three.replace(three.find("\"b\""), 3, "\"b\", \"c\"");
  EXPECT_THAT(error(three), HasSubstr("claims[0].conditions = [\"a\",\"b\",\"c\"]: must be two"));
}

TEST_F(ClaimsFileTest, EveryConditionOfTheShippedClaimsIsOneOfItsShippedStudy) {
  const std::filesystem::path studies = TREEROLL_STUDIES_DIR;
  const auto claims = read_claims(studies.parent_path() / "thesis_claims.toml");
  std::map<std::string, std::pair<std::set<std::string>, int>> known;
  std::set<std::string> sections;
  for (const Claim& claim : claims) {
    sections.insert(claim.section);
    std::vector<std::string> all = claim.conditions;
    all.insert(all.end(), claim.others.begin(), claim.others.end());
    for (const std::string& condition : all) {
      const auto colon = condition.find(':');
      const std::string study =
          colon == std::string::npos ? claim.study : condition.substr(0, colon);
      if (!known.contains(study)) {
        const Study loaded = load_study(studies / (study + ".toml"), {}).study;
        auto& [names, rollouts] = known[study];
        for (const auto& listed : loaded.conditions) names.insert(listed.name);
        rollouts = loaded.conditions.front().exploration.num_rollouts;
      }
      const auto& [names, rollouts] = known[study];
      const std::string name = colon == std::string::npos ? condition : condition.substr(colon + 1);
      EXPECT_TRUE(names.contains(name)) << study << " has no " << name << ": " << claim.text;
      EXPECT_LE(claim.measure.rollout, rollouts) << claim.text;
    }
  }
  EXPECT_EQ(sections, (std::set<std::string>{"4-1-2", "4-2-2", "4-3-2", "4-4", "A-4-3"}));
}

}  // namespace
}  // namespace treeroll::report
