// Bad input at the command line: a clear error, status 2, nothing started.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>

#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr const char* kGood = R"([study]
name = "good"
rollouts = 5
[task]
name = "synthetic"
[policy]
model = "flat"
components = [2]
[exploration]
noise_variance = [0.01, 0.1, 0.01]
[[conditions]]
name = "flat"
)";

struct BadInput {
  const char* what;
  std::string study;                   ///< text of the study file; empty: kGood
  std::vector<std::string> arguments;  ///< after STUDY --state-dir DIR
  std::vector<std::string> says;       ///< parts of the error
};

/// Shown by its name where a test fails.
void PrintTo(const BadInput& bad, std::ostream* out) { *out << bad.what; }

std::string with(const std::string& line, const std::string& replacement) {
  std::string text = kGood;
  return text.replace(text.find(line), line.size(), replacement);
}

class BadInputTest : public ::testing::TestWithParam<BadInput> {};

TEST_P(BadInputTest, EndsWithStatus2AndSaysWhatIsWrong) {
  const BadInput& bad = GetParam();
  const Service service;
  const std::filesystem::path state = service.directory() / "state";
  std::vector<std::string> arguments{service.study(bad.study.empty() ? kGood : bad.study).string(),
                                     "--state-dir", state.string()};
  for (const std::vector<std::string>& option :
       {std::vector<std::string>{"--lcm-url", service.url()}, {"--local-workers", "1"}}) {
    const bool given =
        std::find(bad.arguments.begin(), bad.arguments.end(), option[0]) != bad.arguments.end();
    if (!given) arguments.insert(arguments.end(), option.begin(), option.end());
  }
  arguments.insert(arguments.end(), bad.arguments.begin(), bad.arguments.end());
  Daemon learner("treeroll-learner", arguments, service.directory());
  EXPECT_EQ(learner.wait(seconds(20)), 2) << learner.standard_error();
  for (const std::string& part : bad.says) EXPECT_THAT(learner.standard_error(), HasSubstr(part));
  EXPECT_FALSE(std::filesystem::exists(state));
}

INSTANTIATE_TEST_SUITE_P(
    Table, BadInputTest,
    ::testing::Values(
        BadInput{"syntax", "[study\n", {}, {".toml:1"}},
        BadInput{"unknown_key",
                 with("rollouts = 5", "rollouts = 5\nrolouts = 3"),
                 {},
                 {".toml:4: study.rolouts = 3: unknown key"}},
        BadInput{"wrong_type",
                 with("rollouts = 5", "rollouts = \"many\""),
                 {},
                 {".toml:3: study.rollouts = \"many\": must be an integer"}},
        BadInput{"negative_variance",
                 with("[0.01, 0.1, 0.01]", "[0.01, -0.1, 0.01]"),
                 {},
                 {".toml:10: exploration.noise_variance", "-0.1"}},
        BadInput{"too_few_variances",
                 with("[0.01, 0.1, 0.01]", "[0.01, 0.1]"),
                 {},
                 {".toml:10: exploration.noise_variance", "must hold 3 numbers"}},
        BadInput{"dimension_mismatch",
                 with("\"synthetic\"", "\"synthetic\"\ninput_dim = 3"),
                 {},
                 {"policy", "has 1 inputs and 1 outputs", "3 inputs"}},
        BadInput{"bad_task_setting",
                 with("\"synthetic\"", "\"synthetic\"\nsensitivity = -1"),
                 {},
                 {".toml:6: task.sensitivity = -1", "must be"}},
        BadInput{"unknown_task_with_local_workers",
                 with("\"synthetic\"", "\"juggling\""),
                 {},
                 {"task.name", "juggling"}},
        BadInput{
            "no_conditions", with("[[conditions]]\nname = \"flat\"\n", ""), {}, {"conditions"}},
        BadInput{"huge_counts",
                 with("rollouts = 5", "rollouts = 5\nrepetitions = 99999999999"),
                 {},
                 {".toml:4: study.repetitions = 99999999999"}},
        BadInput{"policy_too_large",
                 with("components = [2]", "components = [100000]"),
                 {},
                 {"policy.components"}},
        BadInput{"override",
                 "",
                 {"--set", "study.rollouts=-4"},
                 {"--set: study.rollouts = -4: must be an integer"}},
        BadInput{"override_without_value", "", {"--set", "study.rollouts"}, {"study.rollouts"}},
        BadInput{"bad_url", "", {"--lcm-url", "udpm://nowhere:99999"}, {"--lcm-url", "nowhere"}},
        BadInput{"unknown_provider",
                 "",
                 {"--lcm-url", "carrier-pigeon://x"},
                 {"--lcm-url", "carrier-pigeon"}},
        BadInput{"unknown_option", "", {"--loca-workers", "2"}, {"--loca-workers"}},
        BadInput{"too_many_workers", "", {"--local-workers", "100000"}, {"--local-workers"}},
        BadInput{"worker_program_missing",
                 "",
                 {"--worker-program", "/nonexistent"},
                 {"--worker-program", "/nonexistent"}},
        BadInput{"worker_program_is_a_folder",
                 "",
                 {"--worker-program", "/tmp"},
                 {"--worker-program = /tmp: must be a program that can be executed"}},
        BadInput{"evaluator_that_is_no_program",
                 "",
                 {"--evaluator", "/etc/passwd"},
                 {"--evaluator = /etc/passwd: must name a program that can be executed"}},
        BadInput{"evaluator_of_no_variable",
                 "",
                 {"--evaluator", "python3 $TREEROLL_NOBODY_SETS_THIS/task.py"},
                 {"names a variable of the environment that is not set"}}),
    [](const auto& test) { return test.param.what; });

TEST(BadPathTest, AMissingStudyAFolderAndAFullStateDirectoryAreRefused) {
  const Service service;
  const auto says = [&](const std::vector<std::string>& arguments, const std::string& part) {
    Daemon learner("treeroll-learner", arguments, service.directory());
    EXPECT_EQ(learner.wait(seconds(20)), 2);
    EXPECT_THAT(learner.standard_error(), HasSubstr(part));
  };
  says({(service.directory() / "none.toml").string()}, "none.toml");
  says({service.directory().string()}, service.directory().string());
  const std::string good = service.study(kGood).string();
  says({good, "--lcm-url", service.url(), "--state-dir", service.directory().string()},
       "--state-dir = " + service.directory().string() + ": must be new or empty");
  says({"nowhere.toml"}, "STUDY = nowhere.toml: no such file; treeroll-learner --new FILE");
  says({good, "--lcm-url", service.url(), "--state-dir", good}, "must be a directory");
  says({"--resume", service.directory().string()}, "must be the state directory of a study");
  says({good, "--resume", service.directory().string()}, "--resume");
  says({}, "STUDY, --resume DIR, --new FILE or --help-keys");
}

TEST(BadPathTest, TheStateDirectoryOfALearnerAtWorkIsNotTaken) {
  const Service service;
  const fs::path directory = service.directory() / "state";
  fs::create_directory(directory);
  write_file(directory / "journal.lcmlog", "");  // what one leaves that came no further
  const std::vector<std::string> arguments = {service.study(kGood).string(), "--lcm-url",
                                              service.url(), "--state-dir", directory.string()};
  const Daemon first("treeroll-learner", arguments, service.directory());  // without a worker
  ASSERT_TRUE(eventually(seconds(20), [&] {
    return fs::file_size(directory / "journal.lcmlog") > 0;
  })) << first.standard_error();
  const std::string study = read_file(directory / "study.toml");
  Daemon second("treeroll-learner", {"--resume", directory.string(), "--lcm-url", service.url()},
                service.directory());
  EXPECT_EQ(second.wait(seconds(20)), 1);
  EXPECT_THAT(second.standard_error(), HasSubstr("another learner is writing it"));
  std::vector<std::string> other = arguments;
  other.insert(other.end(), {"--set", "study.seed=99"});
  Daemon third("treeroll-learner", other, service.directory());
  EXPECT_EQ(third.wait(seconds(20)), 2);
  EXPECT_EQ(read_file(directory / "study.toml"), study);
}

TEST(BadPathTest, WithoutAMulticastRouteTheCureIsNamed) {
  const Service service;
  Daemon probe("/usr/bin/unshare", {"--net", "true"}, service.directory());
  if (probe.wait(seconds(10)) != 0) GTEST_SKIP() << "no network namespaces here";
  Daemon learner(
      "/usr/bin/unshare",
      {"--net", executable("treeroll-learner").string(), service.study(kGood).string(),
       "--state-dir", (service.directory() / "state").string(), "--lcm-url", service.url()},
      service.directory());
  EXPECT_EQ(learner.wait(seconds(20)), 1);
  EXPECT_THAT(learner.standard_error(), HasSubstr("ip route add"));
}

}  // namespace
}  // namespace treeroll::end_to_end
