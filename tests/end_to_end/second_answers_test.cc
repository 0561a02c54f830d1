// A worker that lies now and then is found by running a share of the roll-outs again, and the study
// stands without it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <regex>
#include <string>

#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using std::chrono::seconds;
using ::testing::HasSubstr;

class SecondAnswersOfDaemonsTest : public ::testing::Test {
 protected:
  /// On a host of that name: processes of one host have one vote.
  std::unique_ptr<Daemon> worker(bool lies, const std::string& host = "one") const {
    return std::make_unique<Daemon>(
        "/usr/bin/unshare",
        std::vector<std::string>{"--map-root-user", "--uts", "--", "/bin/sh", "-c",
                                 R"(echo "$0" > /proc/sys/kernel/hostname && exec "$@")", host,
                                 executable("treeroll-worker").string(), "--processes", "1",
                                 "--lcm-url", service_.url(), "--evaluator", TREEROLL_REACH},
        service_.directory(),
        lies ? std::map<std::string, std::string>{{"REACH_LIES", "1"}}
             : std::map<std::string, std::string>{});
  }
  /// Until its end, by workers that run already.
  Service::Learnt learn(const std::string& state, std::vector<std::string> arguments) const {
    const std::vector<std::string> common{"--json", "--lcm-url", service_.url(), "--evaluator",
                                          TREEROLL_REACH};
    arguments.insert(arguments.end(), common.begin(), common.end());
    Daemon learner("treeroll-learner", arguments, service_.directory());
    return service_.learnt(learner, state, seconds(120));
  }
  std::string in(const std::string& name) const { return (service_.directory() / name).string(); }

  const Service service_;
  const std::string study_ =
      service_
          .study(reach_study("name = \"checked\"\nrollouts = 60\nrepetitions = 6\nrecheck = 0.5"))
          .string();
};

TEST_F(SecondAnswersOfDaemonsTest, WhoLiesIsNamedAndTheStudyIsLearntAgainWithoutIt) {
  json of_liar;
  {
    const auto liar = worker(true, "liar");
    const auto one = worker(false, "one");
    const auto two = worker(false, "two");
    const Service::Learnt learnt = learn("lied", {study_, "--state-dir", in("lied")});
    ASSERT_EQ(learnt.status, 0) << learnt.log;
    EXPECT_GT(learnt.summary["rechecks"]["rechecked"], 50);
    EXPECT_GT(learnt.summary["rechecks"]["disputed"], 0);
    for (const json& each : learnt.summary["rechecks"]["workers"]) {
      if (each["pid"] == liar->pid()) {
        of_liar = each;
      } else {
        EXPECT_EQ(each["outvoted"], 0) << each;
      }
    }
    EXPECT_GT(of_liar["outvoted"], 0) << learnt.summary["rechecks"];
    EXPECT_THAT(learnt.log, HasSubstr("two others contradict its answer"));
    // Also what is learnt behind an extension is in suspects.csv.
    fs::copy(in("lied"), in("grown"), fs::copy_options::recursive);
    const Service::Learnt more =
        learn("grown", {"--resume", in("grown"), "--set", "study.rollouts=70"});
    ASSERT_EQ(more.status, 0) << more.log;
    const Said grown = service_.run("treeroll-replay", {in("grown"), "--verify"});
    EXPECT_EQ(grown.status, 0) << grown.errors;
  }
  for (const std::string format : {"csv", "lcm"}) {
    const Said exported = service_.run(
        "treeroll-replay", {in("lied"), "--export", format, "--output", in("exported." + format)});
    ASSERT_EQ(exported.status, 0) << exported.errors;
  }
  const int num_rows = 6 * (60 + 2);
  EXPECT_EQ(count_of(read_file(in("exported.csv")), "\n"), num_rows + 1);
  EXPECT_EQ(count_of(read_file(in("exported.lcm")), "REPLAYED_TREEROLL_REWARDS"), num_rows);
  const std::string id = of_liar["id"];
  EXPECT_THAT(read_file(in("lied") + "/suspects.csv"), HasSubstr("," + id + ","));
  Said said = service_.run("treeroll-replay", {in("lied"), "--verify"});
  EXPECT_EQ(said.status, 0) << said.errors;
  EXPECT_THAT(said.output, HasSubstr("--without-worker " + id));
  EXPECT_THAT(said.output, HasSubstr("results    15 files agree"));
  write_file(in("lied") + "/suspects.csv", "nobody\n");
  said = service_.run("treeroll-replay", {in("lied"), "--verify"});
  EXPECT_EQ(said.status, 1);
  EXPECT_THAT(said.errors, HasSubstr("suspects.csv: differs"));
  said = service_.run("treeroll-report",
                      {in("lied"), "--evaluator", TREEROLL_REACH, "--output", in("report")});
  EXPECT_THAT(read_file(in("report") + "/report.md"), HasSubstr("is contradicted by two others"));

  said = service_.run("treeroll-replay",
                      {in("lied"), "--without-worker", "suspects", "--state-dir", in("sound")});
  ASSERT_EQ(said.status, 0) << said.errors;
  EXPECT_THAT(said.output, HasSubstr("without    worker " + id));
  // A liar that has got little to do may be replaced in all.
  const std::regex counts(R"(left out +(\d+) .* the place of (\d+)\nbesides +(\d+) )");
  std::smatch found;
  ASSERT_TRUE(std::regex_search(said.output, found, counts)) << said.output;
  const bool is_whole = found[1] == found[2] && found[3] == "0";
  EXPECT_EQ(count_of(said.output, "learns them again"), is_whole ? 0 : 1) << said.output;
  said = service_.run("treeroll-replay", {in("sound"), "--verify"});
  EXPECT_EQ(said.status, 0) << said.errors;
  EXPECT_FALSE(fs::exists(in("sound") + "/suspects.csv"));
  write_file(in("sound") + "/suspects.csv", "nobody\n");
  said = service_.run("treeroll-replay", {in("sound"), "--verify"});
  EXPECT_EQ(said.status, 1) << said.output;
  EXPECT_THAT(said.errors, HasSubstr("suspects.csv: differs: the journal has no suspects"));

  const auto one = worker(false);
  const auto two = worker(false);
  const Service::Learnt again = learn("sound", {"--resume", in("sound")});
  ASSERT_EQ(again.status, 0) << again.log;
  const Service::Learnt never_lied = learn("never", {study_, "--state-dir", in("never")});
  ASSERT_EQ(never_lied.status, 0) << never_lied.log;
  EXPECT_EQ(again.rollouts_csv, never_lied.rollouts_csv);
  EXPECT_EQ(again.runs_csv, never_lied.runs_csv);
  EXPECT_EQ(never_lied.summary["rechecks"]["disputed"], 0);
}

/// The runs of a second condition have other numbers then: their questions are the same.
TEST_F(SecondAnswersOfDaemonsTest, AnswersBehindMoreRepetitionsCountForRollOutsOfBefore) {
  const std::string two = service_
                              .study(reach_study("name = \"two\"\nrollouts = 6\nrepetitions = 2\n"
                                                 "recheck = 1.0") +
                                     "[[conditions]]\nname = \"other\"\npolicy.model = \"flat\"\n")
                              .string();
  int first_pid = 0;
  {
    const auto one = worker(false, "one");
    first_pid = one->pid();
    const Service::Learnt alone = learn("grown", {two, "--state-dir", in("grown")});
    ASSERT_EQ(alone.summary["rechecks"]["rechecked"], 0) << "nobody else is there";
  }
  const auto another = worker(false, "another");
  const Service::Learnt more =
      learn("grown", {"--resume", in("grown"), "--set", "study.repetitions=3"});
  ASSERT_EQ(more.status, 0) << more.log;
  const int num_rechecked = more.summary["rechecks"]["rechecked"];
  EXPECT_EQ(num_rechecked, 2 * 2 * (6 + 2)) << "roll-outs, start and final policy of each run";
  std::string first;
  for (const json& each : more.summary["rechecks"]["workers"]) {
    if (each["pid"] == first_pid) first = each["id"];
  }
  Said said = service_.run("treeroll-report", {in("grown"), "--output", in("report")});
  EXPECT_THAT(read_file(in("report") + "/report.md"),
              HasSubstr(fmt::format("{} roll-outs were run again", num_rechecked)))
      << said.errors;
  said = service_.run("treeroll-replay",
                      {in("grown"), "--without-worker", first, "--state-dir", in("without")});
  ASSERT_EQ(said.status, 0) << said.errors;
  EXPECT_THAT(said.output, HasSubstr(fmt::format("has taken the place of {}", num_rechecked)));
  EXPECT_EQ(read_file(in("without") + "/rollouts.csv"), more.rollouts_csv);
}

TEST_F(SecondAnswersOfDaemonsTest, WhatIsAskedWronglyIsRefusedByName) {
  const auto one = worker(false);
  const Service::Learnt learnt =
      learn("alone", {study_, "--state-dir", in("alone"), "--set", "study.rollouts=5"});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  EXPECT_EQ(learnt.summary["rechecks"]["rechecked"], 0);
  const auto refused = [&](const std::string& who, const std::string& where,
                           const std::string& rule) {
    const Said said = service_.run(
        "treeroll-replay", {in("alone"), "--without-worker", who, "--state-dir", in(where)});
    EXPECT_EQ(said.status, 2) << said.output;
    EXPECT_THAT(said.errors, HasSubstr(rule));
  };
  refused("suspects", "new", "no worker of this journal was outvoted");
  refused("7", "new", "--without-worker = 7: must be a worker with answers in the journal");
  refused("liar", "new", "must be the id of a worker, or suspects");
  refused("7", "alone", "must be a new or empty directory");
  EXPECT_FALSE(fs::exists(in("new")));
  const Said said = service_.run("treeroll-replay", {in("alone"), "--without-worker", "7"});
  EXPECT_EQ(said.status, 2);
  EXPECT_THAT(said.errors, HasSubstr("--state-dir"));
  const Service::Learnt too_much = learn("much", {study_, "--set", "study.recheck=1.5"});
  EXPECT_EQ(too_much.status, 2);
  EXPECT_THAT(too_much.log, HasSubstr("study.recheck = 1.5: must be"));
}

}  // namespace
}  // namespace treeroll::end_to_end
