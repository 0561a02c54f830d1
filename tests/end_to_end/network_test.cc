#include "tests/end_to_end/network_test.h"

#include <fmt/format.h>

#include <csignal>
#include <regex>

#include "learner/results/csv.h"
#include "tests/thesis/run_study.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

std::string synthetic(int seed, int rollouts, const std::string& task) {
  return text_of(
      SyntheticStudy{fmt::format("name = \"synthetic\"\nseed = {}\nrepetitions = 15\nrollouts = {}",
                                 seed, rollouts),
                     task});
}

}  // namespace

std::unique_ptr<Daemon> NetworkTest::worker(const Network& network, int host, int processes) const {
  const std::vector<std::string> arguments{"--processes", std::to_string(processes), "--lcm-url",
                                           Network::url()};
  return std::make_unique<Daemon>("treeroll-worker", arguments, service_.directory(),
                                  std::map<std::string, std::string>{}, network.host(host));
}

std::unique_ptr<Daemon> NetworkTest::learner(const Network& network, int host,
                                             const fs::path& study, const std::string& name,
                                             const std::vector<std::string>& more) const {
  std::vector<std::string> arguments{study.string(), "--json",      "--lcm-url",
                                     Network::url(), "--state-dir", state(name).string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return std::make_unique<Daemon>("treeroll-learner", arguments, service_.directory(),
                                  std::map<std::string, std::string>{}, network.host(host));
}

std::unique_ptr<Daemon> NetworkTest::resumed(const Network& network, int host,
                                             const std::string& name) const {
  const std::vector<std::string> arguments{"--resume", state(name).string(), "--json", "--lcm-url",
                                           Network::url()};
  return std::make_unique<Daemon>("treeroll-learner", arguments, service_.directory(),
                                  std::map<std::string, std::string>{}, network.host(host));
}

std::int64_t num_evaluated(Daemon& worker) {
  worker.kill(SIGTERM);
  EXPECT_EQ(worker.wait(seconds(20)), 0) << worker.standard_error();
  const std::string log = worker.standard_error();
  std::smatch found;
  if (!std::regex_search(log, found, std::regex("evaluated ([0-9]+) roll-outs"))) {
    ADD_FAILURE() << "the worker does not say what it has evaluated\n" << log;
    return 0;
  }
  return std::stoll(found[1]);
}

NetworkTest::Files NetworkTest::learnt_alone(const fs::path& study,
                                             const std::vector<std::string>& overrides) const {
  const std::vector<RunRecord> runs = run_study(study, overrides);
  write_rollouts_csv(service_.directory() / "rollouts.csv", runs);
  write_runs_csv(service_.directory() / "runs.csv", runs);
  return {read_file(service_.directory() / "rollouts.csv"),
          read_file(service_.directory() / "runs.csv")};
}

Service::Learnt NetworkTest::expect_learnt(Daemon& learner, const std::string& name,
                                           const Files& files) const {
  Service::Learnt learnt = service_.learnt(learner, name, seconds(200));
  EXPECT_EQ(learnt.status, 0) << learnt.log;
  if (learnt.status != 0) return learnt;
  EXPECT_EQ(learnt.rollouts_csv, files.rollouts_csv);
  EXPECT_EQ(learnt.runs_csv, files.runs_csv);
  EXPECT_EQ(learnt.summary["ledger"]["pending"], 0);
  EXPECT_EQ(learnt.summary["ledger"]["failed"], 0);
  EXPECT_EQ(learnt.summary["ledger"]["conflicting"], 0);
  return learnt;
}

void NetworkTest::expect_verified(const std::string& name) const {
  Daemon replay("treeroll-replay", {state(name).string(), "--verify"}, service_.directory());
  EXPECT_EQ(replay.wait(seconds(60)), 0) << replay.standard_output() << replay.standard_error();
}

bool journal_grows(const fs::path& state, std::uintmax_t num_bytes) {
  const auto size = [&state] {
    std::error_code none_yet;
    const std::uintmax_t bytes = fs::file_size(state / "journal.lcmlog", none_yet);
    return none_yet ? 0 : bytes;
  };
  const std::uintmax_t wanted = size() + num_bytes;
  return eventually(seconds(60), [&] { return size() >= wanted; });
}

std::string swing_up_study(int rollouts) {
  return text_of(SwingUpStudy{.seed = 11, .repetitions = 15, .rollouts = rollouts});
}

std::string synthetic_study(int rollouts, int duration_us) {
  return synthetic(12, rollouts, fmt::format("duration_us = {}", duration_us));
}

std::string patient_study(int rollouts, std::int64_t duration_us) {
  return synthetic(
      12, rollouts,
      fmt::format("duration_us = {}\nmode = \"sleep\"\ntime_limit_s = 10000", duration_us));
}

std::string sleeping_study(int rollouts, int duration_us, int seed) {
  return synthetic(
      seed, rollouts,
      fmt::format("duration_us = {}\nmode = \"sleep\"\ntime_limit_s = 0.05", duration_us));
}

}  // namespace treeroll::end_to_end
