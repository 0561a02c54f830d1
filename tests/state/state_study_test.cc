#include "learner/state/state_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "common/files/whole_file.h"
#include "learner/study/study_extension.h"
#include "tests/files/scratch_folder.h"
#include "tests/journal/learnt_study.h"
#include "tests/state/learn_by_hand.h"

namespace treeroll::state_test {
namespace {

namespace fs = std::filesystem;
using study_test::tree_study;
using testing::HasSubstr;

class StateStudyTest : public testing::Test {
 protected:
  /// Its result files and its study, as bytes.
  std::map<std::string, std::string> files_of(const fs::path& directory) const {
    const StateFiles files = state_files(directory);
    const StateStudy state = read_state_study(files);
    learner::LearnerCore core(state.loaded.study, learner::LearnerSettings{});
    fold_state(files, state, TimePoint{}, core);
    const fs::path output = folder_ / "results";
    fs::create_directories(output);
    write_results(output, core.run_records());
    std::map<std::string, std::string> found{{"study", read_whole_file(study_of(directory))}};
    for (const auto& entry : fs::recursive_directory_iterator(output)) {
      if (entry.is_regular_file()) found[entry.path().filename()] = read_whole_file(entry.path());
    }
    fs::remove_all(output);
    return found;
  }

  /// A study learnt to its end.
  fs::path learnt(const std::string& name, const std::string& text) const {
    HandLearner learner(folder_ / name, text);
    learner.learn(7);
    learner.end();
    EXPECT_TRUE(learner.done());
    return folder_ / name;
  }
  void extend(const fs::path& directory, const std::vector<std::string>& overrides) const {
    HandLearner learner(directory, "", overrides);
    learner.begin();
    learner.learn(3);
    learner.end();
    EXPECT_TRUE(learner.done());
  }
  std::string refusal(const fs::path& directory, const std::vector<std::string>& overrides) const {
    try {
      read_state_study(state_files(directory), overrides);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  }

  ScratchFolder scratch_;
  fs::path folder_ = scratch_.path();
};

std::string with_repetitions(std::string text, const std::string& repetitions) {
  const std::string before = "repetitions = 2";
  return text.replace(text.find(before), before.size(), "repetitions = " + repetitions);
}

TEST_F(StateStudyTest, AnExtendedStudyIsThatOfItsSizeFromTheStartWhateverTheOrder) {
  for (const std::string order : {"in_flight = 1\n", "in_flight = 5\n"}) {
    const fs::path extended = learnt("extended", tree_study(order, 12));
    extend(extended, {"study.rollouts=20"});
    extend(extended, {"study.rollouts=31", "study.repetitions=3"});
    extend(extended, {"study.repetitions=4"});
    const fs::path whole = learnt("whole", with_repetitions(tree_study(order, 31), "4"));
    EXPECT_EQ(files_of(extended), files_of(whole)) << order;
    const StateFiles files = state_files(extended);
    EXPECT_THAT(verify_earlier_studies(files, read_state_study(files)),
                testing::ElementsAre("study.rollouts from 12 to 20",
                                     "study.repetitions from 2 to 3, study.rollouts from 20 to 31",
                                     "study.repetitions from 3 to 4"));
    fs::remove_all(extended);
    fs::remove_all(whole);
  }
}

/// A generation that the budget cut off is completed.
TEST_F(StateStudyTest, APopulationRuleGoesOnWithItsGeneration) {
  std::string text = tree_study("in_flight = 4\n", 13);
  text.insert(text.find("noise_variance"), "rule = \"cem\"\npopulation = 5\n");
  for (const char* key : {"first_update = 2\n", "best_considered = 2\n"}) {
    text.erase(text.find(key), std::string(key).size());
  }
  const fs::path extended = learnt("extended", text);
  extend(extended, {"study.rollouts=32"});
  std::string longer = text;
  longer.replace(longer.find("rollouts = 13"), 13, "rollouts = 32");
  EXPECT_EQ(files_of(extended), files_of(learnt("whole", longer)));
}

TEST_F(StateStudyTest, AStudyThatWasStoppedMidwayIsExtendedAndGoesOn) {
  HandLearner stopped(folder_ / "a", tree_study("in_flight = 3\n", 12));
  stopped.learn(1, 17);
  stopped.end();
  extend(folder_ / "a", {"study.rollouts=20"});
  EXPECT_EQ(files_of(folder_ / "a"), files_of(learnt("whole", tree_study("in_flight = 3\n", 20))));
}

/// In arrival order the journal's order decides: the same records fold to the same.
TEST_F(StateStudyTest, InArrivalOrderTheRolloutsBeforeStay) {
  const fs::path extended = learnt("a", tree_study("in_flight = 4\norder = \"arrival\"\n", 12));
  const std::string before = files_of(extended).at("rollouts.csv");
  extend(extended, {"study.rollouts=20"});
  const std::string after = files_of(extended).at("rollouts.csv");
  std::istringstream lines(before);
  for (std::string line; std::getline(lines, line);) EXPECT_THAT(after, HasSubstr(line + "\n"));
  const StateFiles files = state_files(extended);
  EXPECT_EQ(verify_earlier_studies(files, read_state_study(files)).size(), 1U);
}

TEST_F(StateStudyTest, ALaterEndInTimeGoesOnFromTheJournal) {
  const std::string ends = "in_flight = 3\nstop_after_s = 2.0\n";
  HandLearner first(folder_ / "a", tree_study(ends, 40));
  first.learn(1, 50);
  first.pass(std::chrono::seconds(2));
  first.learn(2);
  EXPECT_TRUE(first.done());
  first.end();
  HandLearner second(folder_ / "a", "", {"study.stop_after_s=5.0"});
  EXPECT_FALSE(second.done());
  second.begin();
  second.learn(4, 20);
  second.pass(std::chrono::seconds(5));
  second.learn(5);
  second.end();
  EXPECT_TRUE(second.done());
  const StateFiles files = state_files(folder_ / "a");
  EXPECT_THAT(verify_earlier_studies(files, read_state_study(files)),
              testing::ElementsAre("study.stop_after_s from 2 to 5"));
  // No result of the first end is lost, and what came after it is learnt from now.
  EXPECT_GT(second.core().counters().applied, first.core().counters().applied);
}

TEST_F(StateStudyTest, ALearnerKilledBeforeTheRecordOfItsExtensionIsCompleted) {
  const fs::path directory = learnt("a", tree_study("", 12));
  {
    HandLearner killed(directory, "", {"study.rollouts=20"});
    killed.begin(false);
  }
  const StateFiles files = state_files(directory);
  EXPECT_TRUE(read_state_study(files).in_journal.is_before_extension);
  EXPECT_EQ(read_state_study(files).extension, "study.rollouts from 12 to 20");
  extend(directory, {});
  EXPECT_EQ(files_of(directory), files_of(learnt("whole", tree_study("", 20))));
  EXPECT_EQ(verify_earlier_studies(files, read_state_study(files)).size(), 1U);
}

TEST_F(StateStudyTest, AskingForTheSameOnceMoreIsNoExtension) {
  const fs::path directory = learnt("a", tree_study("", 12));
  const StateStudy state = read_state_study(state_files(directory), {"study.rollouts=12"});
  EXPECT_FALSE(state.in_journal.is_before_extension);
  EXPECT_EQ(state.extension, "");
}

TEST_F(StateStudyTest, WhatCannotGrowIsRefusedWithKeyAndValues) {
  const fs::path plain = learnt("plain", tree_study("", 12));
  EXPECT_EQ(refusal(plain, {"study.rollouts=11"}),
            "--set: study.rollouts = 11: must be at least 12, which the study has begun with "
            "(condition tree)");
  EXPECT_EQ(refusal(plain, {"study.repetitions=1"}),
            "--set: study.repetitions = 1: must be at least 2, which the study has begun with");
  EXPECT_THAT(refusal(plain, {"study.stop_after_s=9.0"}),
              HasSubstr("study.stop_after_s = 9: the study has begun without an end in time"));
  const std::string only =
      ": once a study has begun, only study.rollouts, study.repetitions and study.stop_after_s "
      "may change, and only to more";
  EXPECT_EQ(refusal(plain, {"study.seed=2"}), "--set: study.seed = 2" + only);
  EXPECT_EQ(refusal(plain, {"exploration.reuse=false"}), "--set: exploration.reuse = false" + only);
  EXPECT_THAT(refusal(plain, {"study.rollouts=99999999999"}), HasSubstr("study.rollouts"));

  HandLearner timed(folder_ / "timed", tree_study("stop_after_s = 2.0\n", 12));
  timed.flush();
  EXPECT_EQ(refusal(folder_ / "timed", {"study.stop_after_s=1.5"}),
            "--set: study.stop_after_s = 1.5: must be at least 2, which the study has begun with");
}

/// A service manager starts it by the same command again.
TEST_F(StateStudyTest, WhatTheStudyHasAlreadyMayBeSaidAgain) {
  const fs::path plain = learnt("plain", tree_study("", 12));
  const StateStudy again = read_state_study(
      state_files(plain), {"study.seed=1", "exploration.reuse=true", "study.rollouts=12"});
  EXPECT_EQ(again.extension, "");
  const StateStudy grown =
      read_state_study(state_files(plain), {"study.seed=1", "study.rollouts=20"});
  EXPECT_EQ(grown.extension, "study.rollouts from 12 to 20");
}

TEST_F(StateStudyTest, AStudyThatIsExchangedIsRefused) {
  const fs::path directory = learnt("a", tree_study("", 12));
  extend(directory, {"study.rollouts=20"});
  const StateFiles files = state_files(directory);
  const fs::path earlier = earlier_study_of(directory, 1);
  const std::string text = read_whole_file(earlier);
  const auto verification = [&] {
    try {
      verify_earlier_studies(files, read_state_study(files));
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(verification(), "");
  std::ofstream(earlier) << text << "# more\n";
  EXPECT_THAT(verification(), HasSubstr("is not the study that the journal tells of"));
  fs::remove(earlier);
  EXPECT_THAT(verification(), HasSubstr("study.before-extension-1.toml: is missing"));
}

/// An evaluation that an extension has superseded counts no more, but it is verified.
TEST_F(StateStudyTest, AForgedEvaluationOfTheStudyBeforeIsFound) {
  const fs::path directory = learnt("a", tree_study("", 12));
  extend(directory, {"study.rollouts=20"});
  std::vector<JournalRecord> records;
  ASSERT_TRUE(read_journal(journal_of(directory),
                           [&](const JournalRecord& record) { records.push_back(record); }));
  for (JournalRecord& record : records) {
    auto* result = std::get_if<AcceptedResult>(&record);
    if (!result || result->key.number >= 0) continue;
    result->content ^= 1;
    break;
  }
  fs::remove(journal_of(directory));
  JournalWriter writer(journal_of(directory));
  for (const JournalRecord& record : records) writer.append(record, 0);
  writer.flush();
  const StateFiles files = state_files(directory);
  EXPECT_THROW(
      {
        try {
          verify_earlier_studies(files, read_state_study(files));
        } catch (const std::runtime_error& error) {
          EXPECT_THAT(error.what(), HasSubstr("the journal answers run"));
          throw;
        }
      },
      std::runtime_error);
}

/// Version 0.1.0 did not evaluate the start, and said nothing of forms and workers.
TEST_F(StateStudyTest, AFinishedStudyOfTheFirstFormHasEndedAndHasItsFinalReward) {
  const fs::path directory = learnt("a", tree_study("", 12));
  std::vector<JournalRecord> records;
  ASSERT_TRUE(read_journal(journal_of(directory),
                           [&](const JournalRecord& record) { records.push_back(record); }));
  fs::remove(journal_of(directory));
  {
    JournalWriter writer(journal_of(directory));
    for (JournalRecord& record : records) {
      if (auto* start = std::get_if<JournalStart>(&record)) start->format = 1;
      const auto* result = std::get_if<AcceptedResult>(&record);
      if (!result || result->key.number != learner::Run::kStart) writer.append(record, 0);
    }
    writer.flush();
  }
  const StateFiles files = state_files(directory);
  const StateStudy state = read_state_study(files);
  learner::LearnerCore core(state.loaded.study, learner::LearnerSettings{});
  fold_state(files, state, TimePoint{}, core);
  const std::vector<RunRecord> runs = core.run_records();
  EXPECT_EQ(what_is_missing(state.loaded.study, runs), "");
  for (const RunRecord& run : runs) {
    EXPECT_FALSE(run.start);
    EXPECT_EQ(run.final_reward, mean_reward(run.finals));
    EXPECT_TRUE(run.final_reward);
  }
  // Whoever goes on with it evaluates the start.
  EXPECT_EQ(core.outcome(), learner::LearnerCore::Outcome::kRunning);
}

TEST_F(StateStudyTest, WhatPeopleAreShownDoesNotDecideWhetherAStudyHasGrown) {
  HandLearner first(folder_ / "a", tree_study("stop_after_s = 10000000.0\n", 12));
  first.flush();
  const StateStudy state =
      read_state_study(state_files(folder_ / "a"), {"study.stop_after_s=10000040.0"});
  EXPECT_TRUE(state.in_journal.is_before_extension);
  EXPECT_EQ(state.extension, "study.stop_after_s from 10000000 to 10000040");
}

TEST_F(StateStudyTest, AStudyMayNotLoseItsEnd) {
  HandLearner learner(folder_ / "a", tree_study("stop_after_s = 2.0\n", 12));
  learner.flush();
  const LoadedStudy before = load_study(study_of(folder_ / "a"), {});
  LoadedStudy after = load_study(study_of(folder_ / "a"), {});
  after.study.stop_after.reset();
  try {
    check_extends(before, after, "study.toml");
    ADD_FAILURE() << "accepted";
  } catch (const StudyError& error) {
    EXPECT_STREQ(error.what(),
                 "study.toml: study.stop_after_s = no end: must be at least 2, which the study has "
                 "begun with");
  }
}

TEST_F(StateStudyTest, TheStudyBeforeAnUnfinishedExtensionIsVerifiedToo) {
  const fs::path directory = learnt("a", tree_study("", 12));
  extend(directory, {"study.rollouts=20"});
  {
    HandLearner killed(directory, "", {"study.rollouts=24"});
    killed.begin(false);
  }
  const StateFiles files = state_files(directory);
  EXPECT_THAT(verify_earlier_studies(files, read_state_study(files)),
              testing::ElementsAre("study.rollouts from 12 to 20", "study.rollouts from 20 to 24"));
}

/// Another learner may extend the study between two looks at its file.
TEST_F(StateStudyTest, AStudyIsKnownByTheTextThatWasRead) {
  const fs::path directory = learnt("a", tree_study("", 12));
  const std::string before = read_whole_file(study_of(directory));
  {
    HandLearner killed(directory, "", {"study.rollouts=20"});
    killed.begin(false);
  }
  const std::string after = read_whole_file(study_of(directory));
  const ContentHash id = content_hash(before);
  std::atomic<bool> stops = false;
  std::thread writer([&] {
    for (bool turn = false; !stops; turn = !turn) {
      std::ofstream(folder_ / "next") << (turn ? before : after);
      fs::rename(folder_ / "next", study_of(directory));
    }
  });
  for (int i = 0; i < 200; ++i) {
    const StateStudy state = read_state_study(state_files(directory));
    const int rollouts = state.loaded.study.conditions[0].exploration.num_rollouts;
    EXPECT_EQ(state.in_journal.id, id);
    EXPECT_EQ(state.in_journal.is_before_extension, rollouts == 20) << rollouts;
  }
  stops = true;
  writer.join();
}

TEST_F(StateStudyTest, SaysHowFarAStudyHasCome) {
  HandLearner learner(folder_ / "a", tree_study("", 12));
  learner.learn(1, 30);
  learner.flush();
  const std::vector<RunRecord> runs = learner.core().run_records();
  EXPECT_THAT(
      what_is_missing(learner.state().loaded.study, runs),
      testing::MatchesRegex("[23].* of 48 roll-outs are learnt and . of 4 runs have ended"));
  learner.learn(1);
  EXPECT_EQ(what_is_missing(learner.state().loaded.study, learner.core().run_records()), "");
}

}  // namespace
}  // namespace treeroll::state_test
