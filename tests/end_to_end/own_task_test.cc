// A task of one's own, from an installed package alone: the example of deploy/own_task.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::Not;

/// This build, installed into a prefix of its own.
class OwnTaskTest : public ::testing::Test {
 protected:
  void SetUp() override {
    run(TREEROLL_CMAKE, {"--install", TREEROLL_BUILD_DIR, "--prefix", prefix_.string()});
  }

  void run(const std::string& program, const std::vector<std::string>& arguments) {
    Daemon process(program, arguments, service_.directory());
    ASSERT_EQ(process.wait(seconds(200)), 0)
        << process.standard_output() << process.standard_error();
  }

  /// The installed learner on the example's study.
  std::unique_ptr<Daemon> learner(const std::string& state, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {(example_ / "pendulum.toml").string(), "--json",
                                         "--local-workers", "2", "--lcm-url", service_.url(),
                                         "--state-dir", (service_.directory() / state).string()});
    return std::make_unique<Daemon>((prefix_ / "bin/treeroll-learner").string(), arguments,
                                    service_.directory());
  }

  const Service service_;
  const fs::path prefix_ = service_.directory() / "prefix";
  const fs::path example_ = prefix_ / "share/treeroll/own_task";
  const fs::path build_ = service_.directory() / "build";
};

TEST_F(OwnTaskTest, IsBuiltAgainstTheInstalledPackageAndLearnt) {
  run(TREEROLL_CMAKE,
      {"-S", example_.string(), "-B", build_.string(), "-DCMAKE_PREFIX_PATH=" + prefix_.string(),
       std::string("-DCMAKE_CXX_FLAGS=-Wall -Wextra ") + TREEROLL_CXX_FLAGS});
  run(TREEROLL_CMAKE, {"--build", build_.string()});
  const std::string worker = (build_ / "pendulum-worker").string();

  const auto process = learner("state", {"--worker-program", worker});
  const Service::Learnt learnt = service_.learnt(*process, "state", seconds(60));
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  EXPECT_EQ(learnt.summary["ledger"]["applied"], 800);
  EXPECT_EQ(learnt.summary["ledger"]["failed"], 0);
  std::smatch first;
  ASSERT_TRUE(std::regex_search(learnt.rollouts_csv, first,
                                std::regex("\nflat,0,[0-9]+,0,1,([0-9.]+),ok,\n")))
      << learnt.rollouts_csv.substr(0, 200);
  EXPECT_LT(std::stod(first[1]), .9) << "nothing was left to learn";
  EXPECT_GT(learnt.summary["conditions"][0]["median_best_reward"], .95) << learnt.summary;

  const fs::path trace = service_.directory() / "pendulum.csv";
  Daemon evaluate((prefix_ / "bin/treeroll-evaluate").string(),
                  {(service_.directory() / "state/policies/flat-0.json").string(),
                   (example_ / "pendulum.toml").string(), "--worker-program", worker, "--json",
                   "--trace", trace.string()},
                  service_.directory());
  EXPECT_EQ(evaluate.wait(seconds(30)), 0) << evaluate.standard_error();
  const nlohmann::json evaluated = nlohmann::json::parse(evaluate.standard_output());
  const std::string reward = learnt.runs_csv.substr(learnt.runs_csv.find("\nflat,0,0,200,") + 14);
  EXPECT_EQ(evaluated["reward"], std::stod(reward)) << learnt.runs_csv;
  EXPECT_THAT(read_file(trace),
              HasSubstr("time_s,angle_rad,cart_m,cart_acceleration_mps2,cost\n0,-3.14159"));

  // Its settings are checked before anything starts.
  const auto refused =
      learner("refused", {"--worker-program", worker, "--set", "task.length_m=-1"});
  EXPECT_EQ(refused->wait(seconds(20)), 2);
  EXPECT_THAT(refused->standard_error(), HasSubstr("--set: task.length_m = -1: must be"));
  EXPECT_FALSE(fs::exists(service_.directory() / "refused"));
}

/// With the flags that pkg-config gives.
TEST_F(OwnTaskTest, APolicyActsInAProgramInC) {
  const std::string program = (service_.directory() / "acts").string();
  const std::string library = (prefix_ / "lib").string();
  run("/bin/sh", {"-c", "cc -std=c11 " TREEROLL_CXX_FLAGS " " TREEROLL_SOURCE_DIR
                        "/tests/policy_library/acts.c -o " +
                            program + " $(PKG_CONFIG_PATH=" + library +
                            "/pkgconfig pkg-config --cflags --libs treeroll_policy)"});
  Daemon acts("/bin/sh", {"-c", "echo '{}' | LD_LIBRARY_PATH=" + library + " " + program},
              service_.directory());
  EXPECT_EQ(acts.wait(seconds(20)), 0) << acts.standard_error();
  EXPECT_THAT(acts.standard_output(), HasSubstr("error: "));
}

/// By where it lies, without a word about the library.
TEST_F(OwnTaskTest, ThePythonPackageIsInstalledWhole) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "Python cannot load a library of a sanitizer build";
#endif
  Daemon python("/bin/sh",
                {"-c", "PYTHONPATH=" + (prefix_ / "lib/python3/dist-packages").string() +
                           " python3 -B -c 'import treeroll, treeroll.lcm_types as types, "
                           "treeroll.policy as policy; types.Types(); "
                           "print(policy._lib().treeroll_policy_version().decode(), "
                           "treeroll.__file__)'"},
                service_.directory());
  EXPECT_EQ(python.wait(seconds(20)), 0) << python.standard_error();
  EXPECT_THAT(python.standard_output(), HasSubstr("0."));
  EXPECT_THAT(python.standard_output(), HasSubstr(prefix_.string()));
}

TEST_F(OwnTaskTest, InstallsAPageAndACompletionOfEachProgram) {
  int num_programs = 0;
  for (const auto& entry : fs::directory_iterator(prefix_ / "bin")) {
    const std::string name = entry.path().filename();
    if (!name.starts_with("treeroll-")) continue;
    if (read_file(entry.path()).starts_with("#!")) continue;  // a script says --help alone
    ++num_programs;
    EXPECT_THAT(read_file(prefix_ / "share/man/man1" / (name + ".1")), HasSubstr(".SH EXAMPLES"))
        << name;
    EXPECT_THAT(read_file(prefix_ / "share/bash-completion/completions" / name),
                HasSubstr("complete -o filenames -F"))
        << name;
    EXPECT_TRUE(fs::exists(prefix_ / "share/zsh/site-functions" / ("_" + name))) << name;
    EXPECT_TRUE(fs::exists(prefix_ / "share/fish/vendor_completions.d" / (name + ".fish"))) << name;
  }
  EXPECT_GE(num_programs, 8);
}

TEST_F(OwnTaskTest, FindsEachHeaderThatAnInstalledOneIncludes) {
  const fs::path headers = prefix_ / "include/treeroll";
  const std::regex include("#include \"([^\"]+)\"");
  int num_headers = 0;
  for (const auto& entry : fs::recursive_directory_iterator(headers)) {
    if (entry.path().extension() != ".h") continue;
    ++num_headers;
    const std::string text = read_file(entry.path());
    for (std::sregex_iterator it(text.begin(), text.end(), include), end; it != end; ++it) {
      EXPECT_TRUE(fs::exists(headers / (*it)[1].str())) << entry.path() << ": " << it->str();
    }
  }
  EXPECT_GT(num_headers, 20);
}

TEST_F(OwnTaskTest, DoesNotNeedTheTreeThatThePackageWasBuiltFrom) {
  int num_files = 0;
  for (const auto& entry : fs::directory_iterator(prefix_ / "lib/cmake/treeroll")) {
    ++num_files;
    EXPECT_THAT(read_file(entry.path()), Not(HasSubstr(TREEROLL_SOURCE_DIR))) << entry.path();
  }
  EXPECT_EQ(num_files, 4);
}

}  // namespace
}  // namespace treeroll::end_to_end
