// A journal read back: treeroll-replay, forged journals, salvage, and logs played into a live
// group.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "learner/journal/journal_file.h"
#include "tests/end_to_end/replay.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::Not;

std::vector<JournalRecord> records_of(const fs::path& directory) {
  std::vector<JournalRecord> records;
  const auto tail = read_journal(directory / "journal.lcmlog",
                                 [&](const JournalRecord& record) { records.push_back(record); });
  EXPECT_TRUE(tail);
  return records;
}

/// A journal of these records in which every check is right.
void forge(const fs::path& directory, const std::vector<JournalRecord>& records) {
  fs::remove(directory / "journal.lcmlog");
  JournalWriter writer(directory / "journal.lcmlog");
  writer.continue_after({});
  for (const JournalRecord& record : records) writer.append(record, 0);
  writer.sync();
}

/// What an error says of where a record is.
std::string at(const std::vector<JournalRecord>& records, std::size_t number) {
  std::size_t offset = 0;
  for (std::size_t i = 0; i < number; ++i) offset += framed_size(records[i]);
  return "record " + std::to_string(number) + " at byte " + std::to_string(offset) + ": ";
}

TEST_F(ReplayTest, VerifiesAJournalOfEitherOrderAndItsFiles) {
  for (const std::string order : {"sequence", "arrival"}) {
    const Said said = verify(learn(order, order));
    EXPECT_EQ(said.status, 0) << said.errors;
    EXPECT_THAT(said.output, HasSubstr("sealed\n"));
    EXPECT_THAT(said.output, HasSubstr("roll-outs  248, 0 failed\n"));  // with eight evaluations
    EXPECT_THAT(said.output, HasSubstr("results    10 files agree\n"));
  }
}

TEST_F(ReplayTest, SummarisesAndExports) {
  const fs::path directory = learn("good");
  const Said summary = run("treeroll-replay", {directory.string()});
  EXPECT_EQ(summary.status, 0) << summary.errors;
  EXPECT_THAT(summary.output, HasSubstr("\ntree "));
  const Said csv = run("treeroll-replay", {directory.string(), "--export", "csv"});
  EXPECT_EQ(
      csv.output.substr(0, csv.output.find('\n')),
      "condition,repetition,run,rollout,layer,reward,status,reason,duration_s,worker,host,pid,"
      "learner,reward_slope,theta,mean,noise_deviations");
  EXPECT_EQ(std::count(csv.output.begin(), csv.output.end(), '\n'), 1 + 248);
  const fs::path file = service_.directory() / "results.jsonl";
  const Said jsonl = run("treeroll-replay", {(directory / "journal.lcmlog").string(), "--export",
                                             "jsonl", "--output", file.string()});
  EXPECT_EQ(jsonl.status, 0) << jsonl.errors;
  const std::string lines = read_file(file);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 248);
  EXPECT_EQ(nlohmann::json::parse(lines.substr(0, lines.find('\n')))["status"], "ok");
  EXPECT_EQ(run("treeroll-replay", {directory.string(), "--output", file.string()}).status, 2);
  fs::remove(directory / "study.toml");
  const Said alone = run("treeroll-replay", {directory.string()});
  EXPECT_EQ(alone.status, 0) << alone.errors;
  EXPECT_THAT(alone.output, HasSubstr("study      none beside it"));
}

/// What a forger who knows the format writes: every record verifies, the story does not.
TEST_F(ReplayTest, AForgedJournalIsFoundOut) {
  const fs::path directory = learn("forged");
  const std::vector<JournalRecord> good = records_of(directory);
  const auto error_of = [&](const std::function<void(std::vector<JournalRecord>&)>& change) {
    std::vector<JournalRecord> records = good;
    change(records);
    forge(directory, records);
    const Said said = verify(directory);
    EXPECT_EQ(said.status, 1) << said.output;
    return said.errors;
  };
  EXPECT_EQ(verify(directory).status, 0);
  EXPECT_THAT(error_of([](auto& records) {
                Outcome& outcome = std::get<AcceptedResult>(records[3]).outcome;
                outcome = Outcome::ok(outcome.reward() / 2);
              }),
              HasSubstr("differ"));
  EXPECT_THAT(error_of([](auto& records) { records.insert(records.begin() + 4, records[3]); }),
              HasSubstr(at(good, 4) + "the journal answers run"));
  EXPECT_THAT(error_of([](auto& records) {
                records.erase(std::find_if(records.begin(), records.end(), [](const auto& record) {
                  const auto* result = std::get_if<AcceptedResult>(&record);
                  return result && result->key.number == 1;
                }));
              }),
              HasSubstr("the journal answers run"));
  EXPECT_THAT(error_of([](auto& records) { std::get<AcceptedResult>(records[5]).content ^= 1; }),
              HasSubstr(at(good, 5) + "the journal answers run"));
  EXPECT_THAT(error_of([](auto& records) { std::get<AcceptedResult>(records[5]).key.run = 9999; }),
              HasSubstr(at(good, 5) + "the journal answers run 9999"));
  EXPECT_THAT(error_of([](auto& records) { std::get<JournalStart>(records[0]).study_id = {}; }),
              HasSubstr("another study"));
  EXPECT_THAT(
      error_of([](auto& records) {
        JournalStart& start = std::get<JournalStart>(records[0]);
        start.algorithm_version = 1;
        start.program = "0.1.0";
      }),
      HasSubstr("version 1 of the algorithm, this program has version 2, which gives other bits: "
                "go on with treeroll 0.1.0, or learn its study.toml anew"));
  EXPECT_THAT(error_of([](auto& records) { records.resize(100); }), HasSubstr("differs from what"));
  EXPECT_THAT(error_of([](auto& records) {
                records.insert(records.begin() + 9, LearningTime{seconds(1)});
              }),
              HasSubstr(at(good, 9) + "the journal counts the time of a study that has no"));
  EXPECT_THAT(error_of([](auto& records) { records.insert(records.end() - 1, records[7]); }),
              HasSubstr("the journal goes on although every run has ended"));
}

/// As version 0.1.0 left it: no start was evaluated, and its tables had fewer columns.
TEST_F(ReplayTest, AFinishedFolderOfTheFirstFormIsWhole) {
  const fs::path directory = learn("old");
  std::vector<JournalRecord> records;
  for (JournalRecord record : records_of(directory)) {
    if (auto* start = std::get_if<JournalStart>(&record)) start->format = 1;
    const auto* result = std::get_if<AcceptedResult>(&record);
    const bool is_of_start = result && result->key.number == -2;
    if (!is_of_start && !std::holds_alternative<KnownWorker>(record)) records.push_back(record);
  }
  forge(directory, records);
  for (const char* file : {"tree-0", "tree-1", "flat-0", "flat-1"}) {
    fs::remove(directory / "policies" / (std::string(file) + ".final.json"));
  }
  const Said verified = verify(directory);
  EXPECT_EQ(verified.status, 0) << verified.errors;
  EXPECT_THAT(verified.output, HasSubstr("programs   treeroll 0.1.0\n"));
  EXPECT_THAT(verified.output, HasSubstr("results    not compared: files of an earlier version\n"));
  EXPECT_THAT(verified.output, Not(HasSubstr("missing")));
  const fs::path results = service_.directory() / "results";
  const Said written = run("treeroll-replay", {directory.string(), "--results", results.string()});
  EXPECT_EQ(written.status, 0) << written.errors;
  EXPECT_TRUE(fs::exists(results / "policies/tree-0.final.json"));
}

/// A learner that is killed between study.toml and the record of an extension.
TEST_F(ReplayTest, ResultsBeforeAnUnfinishedExtensionAreNotComparedAndTheReportFolds) {
  const fs::path directory = learn("killed");
  const std::string journal = read_file(directory / "journal.lcmlog");
  const Said extended =
      run("treeroll-learner", {"--resume", directory.string(), "--set", "study.rollouts=70",
                               "--local-workers", "2", "--lcm-url", service_.url()});
  ASSERT_EQ(extended.status, 0) << extended.errors;
  write_file(directory / "journal.lcmlog", journal);
  const Said verified = verify(directory);
  EXPECT_EQ(verified.status, 0) << verified.errors;
  EXPECT_THAT(verified.output, HasSubstr("extension  study.rollouts from 60 to 70\n"));
  EXPECT_THAT(verified.output,
              HasSubstr("results    not compared: an extension is not finished\n"));
  const Said reported = run("treeroll-report", {directory.string(), "--output",
                                                (service_.directory() / "report").string()});
  EXPECT_EQ(reported.status, 0) << reported.errors;
  EXPECT_THAT(read_file(service_.directory() / "report/report.md"),
              HasSubstr("240 of 280 roll-outs are learnt"));
}

TEST_F(ReplayTest, WhatCannotBeWrittenAtAnExtensionNamesTheWayOn) {
  const fs::path directory = learn("full");
  fs::create_directory(directory / "study.before-extension-1.toml");
  write_file(directory / "study.before-extension-1.toml/x", "");
  const Said refused =
      run("treeroll-learner", {"--resume", directory.string(), "--set", "study.rollouts=70",
                               "--local-workers", "2", "--lcm-url", service_.url()});
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.errors, HasSubstr("go on with --resume " + directory.string()));
}

TEST_F(ReplayTest, ALaterFormIsRefusedByEveryProgram) {
  const fs::path directory = learn("later");
  std::string study = read_file(directory / "study.toml");
  study.replace(study.find("format = 3"), 10, "format = 4");
  write_file(directory / "study.toml", study + "\n[cameras]\nnumber = 2\n");
  const std::string policy = (directory / "policies" / "tree-0.json").string();
  const std::vector<std::pair<std::string, std::vector<std::string>>> calls = {
      {"treeroll-replay", {directory.string()}},
      {"treeroll-report", {directory.string()}},
      {"treeroll-learner", {"--resume", directory.string(), "--salvage"}},
      {"treeroll-evaluate", {policy, (directory / "study.toml").string(), "--condition", "tree"}}};
  for (const auto& [program, arguments] : calls) {
    const Said refused = run(program, arguments);
    EXPECT_EQ(refused.status, 2) << program;
    EXPECT_THAT(refused.errors, HasSubstr("this program reads forms up to 3: take treeroll "));
  }
}

TEST_F(ReplayTest, ChangedAndMissingResultFilesAreNamed) {
  const fs::path directory = learn("files");
  std::string text = read_file(directory / "rollouts.csv");
  text[text.size() / 2] ^= 1;
  write_file(directory / "rollouts.csv", text);
  fs::remove(directory / "policies" / "flat-1.json");
  const Said said = verify(directory);
  EXPECT_EQ(said.status, 1);
  EXPECT_THAT(said.errors, HasSubstr("rollouts.csv: differs"));
  EXPECT_THAT(said.errors, HasSubstr("flat-1.json: is missing"));
}

TEST_F(ReplayTest, OfASealedJournalEveryResultFileIsAskedForWhicheverIsMissing) {
  const fs::path directory = learn("copied");
  fs::remove(directory / "runs.csv");
  const std::string text = read_file(directory / "rollouts.csv");
  write_file(directory / "rollouts.csv", text + "tree,9,9,9,1,0.999,ok,\n");
  const Said changed = verify(directory);
  EXPECT_EQ(changed.status, 1) << changed.output;
  EXPECT_THAT(changed.errors, HasSubstr("runs.csv: is missing"));
  EXPECT_THAT(changed.errors, HasSubstr("rollouts.csv: differs"));
  fs::remove(directory / "rollouts.csv");
  fs::remove_all(directory / "policies");
  EXPECT_EQ(verify(directory).status, 1);
  // A learner that was killed has written none.
  std::vector<JournalRecord> records = records_of(directory);
  records.pop_back();
  forge(directory, records);
  const Said killed = verify(directory);
  EXPECT_EQ(killed.status, 0) << killed.errors;
  EXPECT_THAT(killed.output, HasSubstr("results    no files yet\n"));
}

TEST_F(ReplayTest, WhatIsNoJournalIsRefused) {
  const fs::path folder = service_.directory();
  write_file(folder / "text", "no journal, not even binary, but long enough to be looked at twice");
  fs::create_directory(folder / "empty");
  EXPECT_EQ(verify(folder / "missing").status, 2);
  EXPECT_EQ(verify(folder / "empty").status, 2);
  EXPECT_EQ(verify("/dev/null").status, 2);
  EXPECT_EQ(run("treeroll-replay", {}).status, 2);
  EXPECT_EQ(run("treeroll-replay", {folder.string(), "--verify", "--export", "csv"}).status, 2);
  const Said text = run("treeroll-replay", {(folder / "text").string()});
  EXPECT_EQ(text.status, 1);
  EXPECT_THAT(text.errors, HasSubstr("is no journal: not one record is in its 66 bytes"));
}

TEST_F(ReplayTest, SalvageKeepsThePartBeforeTheDamageAndTheStudyEndsAsItShould) {
  const fs::path directory = learn("damaged");
  const std::string rollouts = read_file(directory / "rollouts.csv");
  std::string journal = read_file(directory / "journal.lcmlog");
  journal[journal.size() / 2] ^= 4;
  write_file(directory / "journal.lcmlog", journal);
  const std::vector<std::string> resume = {"--resume", directory.string(), "--local-workers",
                                           "2",        "--lcm-url",        service_.url()};
  const Said refused = run("treeroll-learner", resume);
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.errors, HasSubstr("--salvage keeps what is before"));
  EXPECT_EQ(read_file(directory / "journal.lcmlog"), journal);

  std::vector<std::string> salvage = resume;
  salvage.emplace_back("--salvage");
  const Said salvaged = run("treeroll-learner", salvage);
  EXPECT_EQ(salvaged.status, 0) << salvaged.errors;
  EXPECT_THAT(salvaged.errors, HasSubstr("kept "));
  EXPECT_EQ(read_file(directory / "journal.lcmlog.damaged"), journal);
  EXPECT_EQ(read_file(directory / "rollouts.csv"), rollouts);
  EXPECT_EQ(verify(directory).status, 0);
  EXPECT_THAT(run("treeroll-learner", salvage).errors, HasSubstr("nothing to salvage"));
}

TEST_F(ReplayTest, AFileThatIsNoJournalIsKeptAndSalvageBeginsAnew) {
  const fs::path directory = learn("none");
  const std::string rollouts = read_file(directory / "rollouts.csv");
  const std::string strange(10'000, 'x');
  write_file(directory / "journal.lcmlog", strange);
  std::vector<std::string> resume = {"--resume", directory.string(), "--local-workers",
                                     "2",        "--lcm-url",        service_.url()};
  const Said refused = run("treeroll-learner", resume);
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.errors, HasSubstr("is no journal: not one record is in its 10000 bytes"));
  EXPECT_EQ(read_file(directory / "journal.lcmlog"), strange);
  resume.emplace_back("--salvage");
  EXPECT_EQ(run("treeroll-learner", resume).status, 0);
  EXPECT_EQ(read_file(directory / "journal.lcmlog.damaged"), strange);
  EXPECT_EQ(read_file(directory / "rollouts.csv"), rollouts);
}

TEST_F(ReplayTest, ResultsOfAnEarlierStopAreNotComparedWhileItGoesOn) {
  const fs::path directory = learn("stopped");
  const std::vector<JournalRecord> good = records_of(directory);
  std::vector<JournalRecord> records(good.begin(), good.begin() + 60);
  records.emplace_back(JournalSeal{});
  records.push_back(good[0]);
  records.insert(records.end(), good.begin() + 60, good.end() - 1);
  forge(directory, records);
  write_file(directory / "runs.csv", "of the stop\n");
  const Said said = verify(directory);
  EXPECT_EQ(said.status, 0) << said.errors;
  EXPECT_THAT(said.output, HasSubstr("not compared"));
}

TEST_F(ReplayTest, LogsPlayedIntoALiveGroupChangeNoResult) {
  const fs::path log = service_.directory() / "run.lcmlog";
  std::optional<Daemon> logger(
      std::in_place, "/usr/bin/lcm-logger",
      std::vector<std::string>{"--quiet", "--lcm-url=" + service_.url(), log.string()},
      service_.directory());
  ASSERT_TRUE(eventually(seconds(10), [&] { return fs::exists(log); }));
  const fs::path first = learn("first");
  logger->kill(SIGINT);
  ASSERT_NE(logger->wait(seconds(10)), -1);
  ASSERT_GT(fs::file_size(log), 10'000);

  // The same study once more, while the first one's log and journal are played.
  const auto play = [&](const fs::path& file) {
    return Daemon("/usr/bin/lcm-logplayer",
                  {"--lcm-url=" + service_.url(), "--speed=1", file.string()},
                  service_.directory());
  };
  const Daemon log_player = play(log);
  const Daemon journal_player = play(first / "journal.lcmlog");
  const fs::path second = learn("second");
  EXPECT_EQ(read_file(first / "rollouts.csv"), read_file(second / "rollouts.csv"));
  EXPECT_EQ(read_file(first / "runs.csv"), read_file(second / "runs.csv"));
  const Said said = verify(second);
  EXPECT_EQ(said.status, 0) << said.errors;
  EXPECT_THAT(said.output, HasSubstr("roll-outs  248, 0 failed\n"));
}

}  // namespace
}  // namespace treeroll::end_to_end
