#include "tests/end_to_end/network_test.h"

#include <fmt/format.h>

#include <csignal>
#include <regex>

#include "learner/journal/journal_file.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

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

std::int64_t num_journalled(const fs::path& state) {
  std::int64_t count = 0;
  const auto tail = read_journal(state / "journal.lcmlog", [&](const JournalRecord& record) {
    count += std::holds_alternative<AcceptedResult>(record) ? 1 : 0;
  });
  return tail ? count : 0;
}

std::string swing_up_study(int rollouts) {
  return fmt::format(R"(
[study]
name = "swing_up"
seed = 11
repetitions = 15
rollouts = {}
[task]
name = "swing_up"
plant = "ode"
[policy]
components = [2, 4]
[exploration]
noise_variance = [0.01, 0.3, 0.02]
initial_noise_factor = 0.03
convergence_window = 10
[[conditions]]
name = "tree"
policy.model = "tree"
[[conditions]]
name = "flat"
policy.model = "flat"
)",
                     rollouts);
}

std::string synthetic_study(int rollouts, int duration_us) {
  return fmt::format(R"(
[study]
name = "synthetic"
seed = 12
repetitions = 15
rollouts = {}
[task]
name = "synthetic"
duration_us = {}
[policy]
components = [2, 4]
[exploration]
noise_variance = [0.01, 0.1, 0.01]
convergence_window = 10
[[conditions]]
name = "tree"
policy.model = "tree"
[[conditions]]
name = "flat"
policy.model = "flat"
)",
                     rollouts, duration_us);
}

}  // namespace treeroll::end_to_end
