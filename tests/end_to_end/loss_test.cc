// Packets are lost between the hosts; what is learnt stays the same to the bit.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <iostream>

#include "learner/report/csv.h"
#include "tests/end_to_end/network_test.h"
#include "tests/thesis/run_study.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

/// Two hosts: the learner on one, a worker daemon with two evaluators on the other, so that every
/// message crosses the network.
class LossTest : public NetworkTest {
 protected:
  struct Outcome {
    Service::Learnt learnt;
    double rollouts_per_s = 0;
    double simulations_per_rollout = 0;
    double reissues_per_rollout = 0;
  };

  Outcome learn_under_loss(const fs::path& study, int percent) {
    Network network(2);
    network.lose(percent);
    const auto far = worker(network, 1, 2);
    const std::string name = fmt::format("state-{}", num_learnt_++);
    const auto near = learner(network, 0, study, name);
    Outcome outcome{.learnt = service_.learnt(*near, name, seconds(200))};
    EXPECT_EQ(outcome.learnt.status, 0) << outcome.learnt.log;
    if (outcome.learnt.status != 0) return outcome;
    EXPECT_EQ(network.num_lost() > 0, percent > 0);
    const auto& ledger = outcome.learnt.summary["ledger"];
    EXPECT_EQ(ledger["pending"], 0);
    EXPECT_EQ(ledger["failed"], 0);
    EXPECT_EQ(ledger["conflicting"], 0);
    const auto applied = ledger["applied"].get<double>();
    // Beside the budget each run's final policy is evaluated.
    outcome.simulations_per_rollout =
        static_cast<double>(num_evaluated(*far)) / (applied + kNumRuns);
    outcome.reissues_per_rollout = ledger["reissued"].get<double>() / applied;
    outcome.rollouts_per_s = applied / outcome.learnt.summary["seconds"].get<double>();
    std::cout << fmt::format(
        "{:2} % lost: {:6.0f} roll-outs/s, {:.4f} simulations and {:.3f} re-issues a roll-out\n",
        percent, outcome.rollouts_per_s, outcome.simulations_per_rollout,
        outcome.reissues_per_rollout);
    return outcome;
  }

  void expect_one_result_at_any_loss(const std::string& text) {
    const fs::path study = service_.study(text);
    const std::vector<RunRecord> runs = run_study(study, {});
    ASSERT_EQ(runs.size(), kNumRuns);
    write_rollouts_csv(service_.directory() / "rollouts.csv", runs);
    write_runs_csv(service_.directory() / "runs.csv", runs);
    for (const int percent : {0, 10, 30}) {
      const Outcome outcome = learn_under_loss(study, percent);
      EXPECT_EQ(outcome.learnt.rollouts_csv, read_file(service_.directory() / "rollouts.csv"));
      EXPECT_EQ(outcome.learnt.runs_csv, read_file(service_.directory() / "runs.csv"));
      EXPECT_GE(outcome.simulations_per_rollout, 1);
      EXPECT_LE(outcome.simulations_per_rollout, 1.05);
    }
  }

  static constexpr std::size_t kNumRuns = 30;

 private:
  int num_learnt_ = 0;
};

TEST_F(LossTest, TheSwingUpIsLearntToTheSameBitsAtAnyLoss) {
  expect_one_result_at_any_loss(swing_up_study(20));
}

TEST_F(LossTest, ShortRolloutsAreLearntToTheSameBitsAtAnyLoss) {
  expect_one_result_at_any_loss(synthetic_study(200, 50));
}

}  // namespace
}  // namespace treeroll::end_to_end
