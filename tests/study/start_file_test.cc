#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/policy/policy.h"
#include "learner/study/study_file.h"
#include "tests/study/small_study.h"
#include "tests/study/study_text.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using study_test::error_of;
using study_test::StudyText;
using study_test::with;
using study_test::write;
using testing::HasSubstr;

/// A policy that no fit gives: that of the small study with a theta of its own, at layer 2.
std::string learnt_policy(const LoadedStudy& small) {
  const PolicyPtr policy = small.study.conditions[0].start->at_layer(2);
  return to_json(*policy->with(policy->theta() * 1.01));
}

/// The small study, starting from the policy of the named file.
std::string starting_from(const std::string& file) {
  return with("model = \"top_down_tree\"", "start_file = \"" + file + "\"");
}

std::string start_of(const LoadedStudy& loaded) {
  return to_json(*loaded.study.conditions[0].start->at_layer(2));
}

TEST(StartFileTest, AStudyStartsFromThePolicyOfAFileBesideIt) {
  const StudyText small(study_test::kSmallStudy);
  const std::string learnt = learnt_policy(load_study(small.path(), {}));
  const StudyText study(starting_from("learnt.json"));
  write(study.folder() / "learnt.json", learnt);
  EXPECT_EQ(start_of(load_study(study.path(), {})), learnt);
}

TEST(StartFileTest, TheCommandLineNamesOneForAStudyThatDescribesAnother) {
  const StudyText small(study_test::kSmallStudy);
  const LoadedStudy described = load_study(small.path(), {});
  const std::string learnt = learnt_policy(described);
  const fs::path file = small.folder() / "learnt.json";
  write(file, learnt);
  // Relative to the current folder, not to the study's.
  const std::string named = fs::relative(file, fs::current_path()).string();
  const LoadedStudy given = load_study(small.path(), {"policy.start_file=" + named});
  EXPECT_EQ(start_of(given), learnt);
  EXPECT_NE(start_of(described), learnt);
}

TEST(StartFileTest, TheResolvedStudyHoldsThePolicyItself) {
  const StudyText small(study_test::kSmallStudy);
  const StudyText study(starting_from("learnt.json"));
  write(study.folder() / "learnt.json", learnt_policy(load_study(small.path(), {})));
  const LoadedStudy loaded = load_study(study.path(), {});
  fs::remove(study.folder() / "learnt.json");
  const StudyText resolved(loaded.resolved.to_toml(""));
  const LoadedStudy again = load_study(resolved.path(), {});
  EXPECT_EQ(start_of(again), start_of(loaded));
  EXPECT_EQ(again.resolved.to_toml(""), loaded.resolved.to_toml(""));
}

TEST(StartFileTest, ThePolicyKeepsItsNamesAndMustBeOneOfTheTask) {
  const StudyText small(study_test::kSmallStudy);
  const LoadedStudy described = load_study(small.path(), {});
  const SignalNames names{{"time_s"}, {"force_n"}};
  const PolicyPtr start = described.study.conditions[0].start;
  ASSERT_EQ(start->input_dim() + start->output_dim(), 2);
  const StudyText study(starting_from("learnt.json"));
  write(study.folder() / "learnt.json", to_json(*start, names));
  const LoadedStudy loaded = load_study(study.path(), {});
  EXPECT_EQ(loaded.study.conditions[0].signals, names);
  EXPECT_EQ(to_json(*loaded.study.conditions[0].start), to_json(*start)) << "what workers are sent";
  const StudyText resolved(loaded.resolved.to_toml(""));
  EXPECT_EQ(load_study(resolved.path(), {}).study.conditions[0].signals, names);

  EXPECT_NO_THROW(check_task(loaded, 0, {1, 1, names}));
  EXPECT_NO_THROW(check_task(loaded, 0, {1, 1}));
  EXPECT_NO_THROW(check_task(described, 0, {1, 1, names}));
  EXPECT_THAT(error_of(study,
                       [](const fs::path& path) {
                         check_task(load_study(path, {}), 0, {1, 1, {{"phase"}, {"force_n"}}});
                       }),
              HasSubstr("policy.start_file: the policy's inputs are time_s, those of the task are "
                        "phase: must be a policy of this task, or name no signals"));
  write(study.folder() / "learnt.json", to_json(*start, {{"time_s", "b"}, {"force_n"}}));
  EXPECT_THAT(error_of(study, [](const fs::path& path) { (void)load_study(path, {}); }),
              HasSubstr("$.signals are wrong: inputs: has 2 names, must have 1"));
}

TEST(StartFileTest, ErrorsNameTheLineAndTheFile) {
  const auto error_with = [](const std::string& policy_lines, const std::string& file_text) {
    const StudyText study(with("model = \"top_down_tree\"", policy_lines));
    write(study.folder() / "start.json", file_text);
    fs::create_directory(study.folder() / "folder");
    return error_of(study, [](const fs::path& path) { (void)load_study(path, {}); });
  };
  EXPECT_THAT(error_with("start_file = \"none.json\"", ""),
              testing::AllOf(HasSubstr("FILE:9: policy.start_file = "),
                             HasSubstr("none.json: no such file (condition tree)")));
  EXPECT_THAT(error_with("start_file = \"folder\"", ""), HasSubstr("is a folder"));
  EXPECT_THAT(error_with("start_file = 3", ""),
              HasSubstr("FILE:9: policy.start_file = 3: must be a string"));
  EXPECT_THAT(error_with("start_file = \"start.json\"", "{}"), HasSubstr("$.format"));
  EXPECT_THAT(error_with("start_file = \"start.json\"", std::string((1U << 20U) + 1, ' ')),
              HasSubstr("is too large"));
  EXPECT_THAT(error_with("start_file = \"start.json\"\ngiven = \"{}\"", "{}"),
              HasSubstr("must not stand beside policy.given"));
  EXPECT_THAT(error_with("given = \"{}\"", ""),
              HasSubstr("FILE:9: policy.given: policy: $.format"));
  EXPECT_THAT(error_with("given = 3", ""), HasSubstr("policy.given = 3: must be a string"));
}

TEST(StartFileTest, WhatElseIsSaidOfThePolicyDoesNotCountButIsChecked) {
  const StudyText small(study_test::kSmallStudy);
  const std::string learnt = learnt_policy(load_study(small.path(), {}));
  const StudyText study(
      with("model = \"top_down_tree\"", "start_file = \"learnt.json\"\nmodle = \"top_down_tree\""));
  write(study.folder() / "learnt.json", learnt);
  EXPECT_THAT(error_of(study, [](const fs::path& path) { (void)load_study(path, {}); }),
              HasSubstr("FILE:10: policy.modle = \"top_down_tree\": unknown key"));
}

TEST(StartFileTest, ConditionsThatWouldOnlyLookDifferentAreRefused) {
  const StudyText small(study_test::kSmallStudy);
  const fs::path file = small.folder() / "learnt.json";
  write(file, learnt_policy(load_study(small.path(), {})));
  const auto error_with = [&](const std::string& flat, const std::string& start_file) {
    const std::string conditions =
        "conditions=[{name = \"tree\"}, {name = \"flat\", " + flat + "}]";
    try {
      (void)load_study(small.path(), {conditions, "policy.start_file=" + start_file});
    } catch (const StudyError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(error_with("policy.model = \"flat\"", file.string()),
              testing::AllOf(HasSubstr("--set: policy.model = \"flat\": must be the same in all"),
                             HasSubstr("(condition flat)")));
  EXPECT_THAT(error_with("policy.components = [8]", file.string()), HasSubstr("policy.components"));
  EXPECT_EQ(error_with("exploration.initial_noise_factor = 0.5", file.string()), "");
}

}  // namespace
}  // namespace treeroll
