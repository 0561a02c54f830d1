// The programs as shells, service managers and other programs start them: with closed descriptors,
// at a terminal or none, with limits; signals at any moment; files that others touch.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <set>
#include <sstream>

#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

/// Roll-outs that sleep, of a policy of one Gaussian.
std::string sleeping(int num_rollouts, int duration_us) {
  return fmt::format(R"([study]
name = "sleeping"
rollouts = {}
[task]
name = "synthetic"
mode = "sleep"
duration_us = {}
[policy]
start = "components"
layout = "means"
[policy.layer_1]
range = [0.0, 2.0]
outputs = [0.0]
deviations = [0.5, 0.5]
[exploration]
noise_variance = [0.01, 0.1]
[[conditions]]
name = "plain"
)",
                     num_rollouts, duration_us);
}

class ProgramsTest : public ::testing::Test {
 protected:
  /// Starts a program from a shell: `shell` ends with `exec "$0" "$@"` and what is redirected.
  Daemon from_shell(const std::string& shell, const std::string& program,
                    const std::vector<std::string>& arguments,
                    const std::map<std::string, std::string>& environment = {}) {
    std::vector<std::string> words{"-c", shell, executable(program).string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return {"/bin/bash", words, service_.directory(), environment};
  }
  fs::path state() const { return service_.directory() / "state"; }
  std::vector<std::string> learning(int num_rollouts, int duration_us) {
    return {service_.study(sleeping(num_rollouts, duration_us)).string(),
            "--lcm-url",
            service_.url(),
            "--local-workers",
            "1",
            "--state-dir",
            state().string()};
  }
  bool journal_reaches(std::uintmax_t num_bytes) const {
    return eventually(seconds(60), [&] {
      std::error_code none;
      const std::uintmax_t size = fs::file_size(state() / "journal.lcmlog", none);
      return !none && size >= num_bytes;
    });
  }
  void expect_resumed() {
    Daemon learner(
        "treeroll-learner",
        {"--resume", state().string(), "--lcm-url", service_.url(), "--local-workers", "1"},
        service_.directory());
    EXPECT_EQ(learner.wait(seconds(60)), 0) << learner.standard_error();
  }

  Service service_;
};

/// Of the learner and of the worker that it starts.
TEST_F(ProgramsTest, EveryLineOfAJsonLogIsAnObject) {
  const fs::path study = service_.study(sleeping(20, 1000));
  const Said said =
      service_.run("treeroll-learner",
                   {study.string(), "--local-workers", "1", "--lcm-url", service_.url(),
                    "--state-dir", (service_.directory() / "json").string(), "--log", "json"});
  EXPECT_EQ(said.status, 0) << said.errors;
  std::set<std::string> programs;
  std::istringstream lines(said.errors);
  for (std::string line; std::getline(lines, line);) {
    const nlohmann::json object = nlohmann::json::parse(line, nullptr, false);
    ASSERT_TRUE(object.is_object()) << line;
    EXPECT_THAT(object["time"].get<std::string>(),
                MatchesRegex("[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9:]{8}[.][0-9]{3}Z"));
    EXPECT_EQ(object["level"], "info");
    EXPECT_FALSE(object["text"].get<std::string>().empty());
    EXPECT_GT(object["pid"], 0);
    programs.insert(object["program"]);
  }
  EXPECT_EQ(programs, (std::set<std::string>{"treeroll-learner", "treeroll-worker"}));
  EXPECT_EQ(service_.run("treeroll-learner", {study.string(), "--log", "xml"}).status, 2);
}

TEST_F(ProgramsTest, EveryOneSaysItsVersionInTheSameForm) {
  std::string of_first;
  for (const char* name : {"learner", "worker", "evaluate", "replay", "report", "doctor", "top"}) {
    const std::string program = std::string("treeroll-") + name;
    Daemon asked(program, {"--version"}, service_.directory());
    EXPECT_EQ(asked.wait(seconds(20)), 0);
    const std::string said = asked.standard_output();
    EXPECT_THAT(said, MatchesRegex(program + " [0-9]+\\.[0-9]+\\.[0-9]+ "
                                             "\\(commit ([0-9a-f]{12}(, changed)?|unknown)\\)\n"));
    const std::string rest = said.substr(said.find(' '));
    if (of_first.empty()) of_first = rest;
    EXPECT_EQ(rest, of_first);
  }
}

TEST_F(ProgramsTest, TheDoctorNamesAPathThatIsNotUtf8InJson) {
  const Said said = service_.run("treeroll-doctor", {"--lcm-url", service_.url(), "--seconds", "1",
                                                     "--json", "--folder", "/absent/\xff"});
  const nlohmann::json findings = nlohmann::json::parse(said.output, nullptr, false);
  ASSERT_TRUE(findings.is_array()) << said.errors;
  EXPECT_THAT(said.output, HasSubstr("/absent/"));
}

TEST_F(ProgramsTest, ClosedDescriptorsAreNoHarm) {
  for (const char* closed : {"0<&-", "0<&- 1>&-", "0<&- 1>&- 2>&-", "2>&- 1>&-"}) {
    Daemon learner = from_shell(std::string("exec \"$0\" \"$@\" ") + closed, "treeroll-learner",
                                learning(5, 100));
    EXPECT_EQ(learner.wait(seconds(60)), 0) << closed << learner.standard_error();
    EXPECT_TRUE(fs::exists(state() / "runs.csv")) << closed;
    Daemon evaluate = from_shell(
        std::string("exec \"$0\" \"$@\" ") + closed, "treeroll-evaluate",
        {(state() / "policies" / "plain-0.json").string(), (state() / "study.toml").string()});
    EXPECT_EQ(evaluate.wait(seconds(60)), 0) << closed << evaluate.standard_error();
    fs::remove_all(state());
  }
}

TEST_F(ProgramsTest, AStopWhileALearnerStartsEndsWithItsStatus) {
  const fs::path slow = service_.directory() / "slow-worker";
  write_file(slow, "#!/bin/sh\n: > \"$0.asked\"\nexec sleep 60\n");
  fs::permissions(slow, fs::perms::owner_all);
  const fs::path asked = slow.string() + ".asked";
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    std::vector<std::string> arguments = learning(5, 100);
    arguments.insert(arguments.end(), {"--worker-program", slow.string()});
    Daemon learner("treeroll-learner", arguments, service_.directory());
    ASSERT_TRUE(eventually(seconds(60), [&] { return fs::exists(asked); }));
    learner.kill(signal);
    EXPECT_EQ(learner.wait(seconds(20)), 3) << signal;
    EXPECT_THAT(learner.standard_error(), HasSubstr("asked to end while it was starting"));
    EXPECT_FALSE(fs::exists(state()));
    fs::remove(asked);
  }
}

TEST_F(ProgramsTest, HangingUpStopsALearnerAndAWorkerAsSigtermDoes) {
  Daemon learner("treeroll-learner", learning(100'000, 1000), service_.directory());
  Daemon worker("treeroll-worker", {"--processes", "1", "--lcm-url", service_.url()},
                service_.directory());
  ASSERT_TRUE(journal_reaches(2000)) << learner.standard_error();
  worker.kill(SIGHUP);
  EXPECT_EQ(worker.wait(seconds(60)), 0) << worker.standard_error();
  learner.kill(SIGHUP);
  EXPECT_EQ(learner.wait(seconds(60)), 3) << learner.standard_error();
  EXPECT_TRUE(fs::exists(state() / "runs.csv"));
}

TEST_F(ProgramsTest, WhatIsSetToBeIgnoredStaysSo) {
  Daemon learner =
      from_shell("trap '' HUP; exec \"$0\" \"$@\"", "treeroll-learner", learning(2'000, 100));
  ASSERT_TRUE(journal_reaches(2000)) << learner.standard_error();
  learner.kill(SIGHUP);
  EXPECT_EQ(learner.wait(seconds(60)), 0) << learner.standard_error();
}

TEST_F(ProgramsTest, AReaderThatHasGoneIsAnErrorWithAWord) {
  const std::string to_nobody = "exec 3> >(exit 0); wait $!; exec \"$0\" \"$@\" >&3";
  Daemon learner = from_shell(to_nobody, "treeroll-learner", learning(50, 100));
  EXPECT_EQ(learner.wait(seconds(60)), 1) << learner.standard_error();
  EXPECT_THAT(learner.standard_error(), HasSubstr("cannot write to standard output: Broken pipe"));
  Daemon replay = from_shell(to_nobody, "treeroll-replay",
                             {state().string(), "--export", "csv", "--output", "/dev/stdout"});
  EXPECT_EQ(replay.wait(seconds(60)), 1);
  EXPECT_THAT(replay.standard_error(), HasSubstr("cannot write /dev/stdout: Broken pipe"));
}

TEST_F(ProgramsTest, TracesGoToPipesAndDevicesAndLeaveThem) {
  Daemon learner(
      "treeroll-learner",
      {service_.study(text_of(SwingUpStudy{.repetitions = 1, .rollouts = 3})).string(), "--lcm-url",
       service_.url(), "--local-workers", "1", "--state-dir", state().string()},
      service_.directory());
  ASSERT_EQ(learner.wait(seconds(60)), 0) << learner.standard_error();
  const std::vector<std::string> arguments{(state() / "policies" / "tree-0.json").string(),
                                           (state() / "study.toml").string()};
  Daemon piped = from_shell(
      "exec \"$0\" \"$@\" --trace >(cat > " + (service_.directory() / "trace.csv").string() + ")",
      "treeroll-evaluate", arguments);
  EXPECT_EQ(piped.wait(seconds(60)), 0) << piped.standard_error();
  EXPECT_TRUE(eventually(seconds(20), [&] {
    return count_of(read_file(service_.directory() / "trace.csv"), "\n") > 100;
  }));
  Daemon full = from_shell("exec \"$0\" \"$@\" --trace /dev/full", "treeroll-evaluate", arguments);
  EXPECT_EQ(full.wait(seconds(60)), 1);
  EXPECT_THAT(full.standard_error(), HasSubstr("cannot write /dev/full: No space left on device"));
  EXPECT_TRUE(fs::is_character_file(fs::symlink_status("/dev/full")));
}

TEST_F(ProgramsTest, ALimitOnTheSizeOfFilesIsAnErrorThatNamesTheCure) {
  Daemon learner =
      from_shell("ulimit -f 16; exec \"$0\" \"$@\"", "treeroll-learner", learning(400, 100));
  EXPECT_EQ(learner.wait(seconds(60)), 1) << learner.standard_error();
  EXPECT_THAT(learner.standard_error(),
              AllOf(HasSubstr("cannot write the journal: File too large"),
                    HasSubstr("go on with --resume " + state().string())));
  expect_resumed();
}

TEST_F(ProgramsTest, AJournalThatIsCutWhileALearnerWritesItEndsTheLearner) {
  Daemon learner("treeroll-learner", learning(100'000, 1000), service_.directory());
  ASSERT_TRUE(journal_reaches(4000)) << learner.standard_error();
  fs::resize_file(state() / "journal.lcmlog", 2000);
  EXPECT_EQ(learner.wait(seconds(60)), 1) << learner.standard_error();
  EXPECT_THAT(learner.standard_error(),
              HasSubstr("journal.lcmlog: another process has cut the journal"));
}

TEST_F(ProgramsTest, EvaluatorsThatCannotStartDoNotFillTheLog) {
  Daemon worker = from_shell("ulimit -n 24; exec \"$0\" \"$@\"", "treeroll-worker",
                             {"--processes", "64", "--lcm-url", service_.url()});
  // Ever more seldom, but 64 of them: within the limits of all kinds of line, a minute each.
  EXPECT_FALSE(eventually(seconds(4), [&] { return count_of(worker.standard_error(), "\n") > 40; }))
      << worker.standard_error();
  EXPECT_THAT(worker.standard_error(), HasSubstr("cannot start an evaluator: socketpair: "));
}

TEST_F(ProgramsTest, AHostNameThatIsNotUtf8SilencesNobody) {
  Daemon probe("/usr/bin/unshare", {"--uts", "true"}, service_.directory());
  if (probe.wait(seconds(10)) != 0) GTEST_SKIP() << "no namespaces here";
  std::vector<std::string> words{
      "--uts", "/bin/bash", "-c",
      "printf 'h\\377st' > /proc/sys/kernel/hostname; exec \"$0\" \"$@\"",
      executable("treeroll-learner").string()};
  for (const std::string& word : learning(5, 100)) words.push_back(word);
  Daemon learner("/usr/bin/unshare", words, service_.directory());
  EXPECT_EQ(learner.wait(seconds(60)), 0) << learner.standard_error();
  EXPECT_THAT(learner.standard_error(), HasSubstr("(h?st pid "));
}

/// The far side of a terminal.
class Terminal {
 public:
  Terminal() : number_(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK)) {
    if (number_ < 0 || grantpt(number_) != 0 || unlockpt(number_) != 0) return;
    if (const char* name = ptsname(number_)) name_ = name;
  }
  ~Terminal() { close(number_); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  const std::string& name() const { return name_; }
  /// All that was written so far.
  const std::string& read_all() {
    char buffer[4096];
    for (ssize_t size = 0; (size = read(number_, buffer, sizeof buffer)) > 0;) {
      text_.append(buffer, static_cast<std::size_t>(size));
    }
    return text_;
  }

 private:
  int number_;
  std::string name_;
  std::string text_;
};

TEST_F(ProgramsTest, ProgressStaysInPlaceOnATerminalAlone) {
  const auto shown = [&](const std::map<std::string, std::string>& environment) {
    Terminal terminal;
    if (terminal.name().empty()) return std::string("no terminal");
    Daemon learner = from_shell("exec \"$0\" \"$@\" 2>" + terminal.name(), "treeroll-learner",
                                learning(450, 10'000), environment);
    bool ended = false;
    EXPECT_TRUE(eventually(seconds(60), [&] {
      terminal.read_all();
      ended = learner.wait(seconds(0)) == 0;
      return ended;
    })) << terminal.read_all();
    fs::remove_all(state());
    return terminal.read_all();
  };
  const std::string in_place = shown({{"TERM", "xterm"}, {"NO_COLOR", ""}});
  if (in_place == "no terminal") GTEST_SKIP() << "no pseudo-terminals here";
  EXPECT_GE(count_of(in_place, "] "), 2);
  EXPECT_THAT(in_place, AllOf(HasSubstr("[#"), HasSubstr("\r\x1b[K"), HasSubstr("\x1b[32m")));
  EXPECT_THAT(in_place, Not(HasSubstr("info: [")));
  EXPECT_THAT(shown({{"TERM", "xterm"}, {"NO_COLOR", "1"}}),
              AllOf(HasSubstr("\r\x1b[K"), Not(HasSubstr("\x1b[32m"))));
  EXPECT_THAT(shown({{"TERM", "dumb"}}),
              AllOf(Not(HasSubstr("\x1b")), HasSubstr(" of 452 roll-outs (")));
}

}  // namespace
}  // namespace treeroll::end_to_end
