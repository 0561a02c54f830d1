#pragma once

#include <fmt/format.h>

#include <iostream>
#include <string>

#include "tests/end_to_end/network_test.h"

namespace treeroll::end_to_end {

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

  Outcome learn_under_loss(const std::filesystem::path& study, const Files& files, int percent) {
    Network network(2);
    network.lose(percent);
    const auto far = worker(network, 1, 2);
    const std::string name = fmt::format("state-{}", num_learnt_++);
    const auto near = learner(network, 0, study, name);
    Outcome outcome{.learnt = expect_learnt(*near, name, files)};
    if (outcome.learnt.status != 0) return outcome;
    EXPECT_EQ(network.num_lost() > 0, percent > 0);
    const auto& ledger = outcome.learnt.summary["ledger"];
    const auto applied = ledger["applied"].get<double>();
    // Beside the budget each run's start policy and final policy are evaluated.
    outcome.simulations_per_rollout =
        static_cast<double>(num_evaluated(*far)) / (applied + 2 * kNumRuns);
    outcome.reissues_per_rollout = ledger["reissued"].get<double>() / applied;
    outcome.rollouts_per_s = applied / outcome.learnt.summary["seconds"].get<double>();
    std::cout << fmt::format(
        "{:2} % lost: {:6.0f} roll-outs/s, {:.4f} simulations and {:.3f} re-issues a roll-out\n",
        percent, outcome.rollouts_per_s, outcome.simulations_per_rollout,
        outcome.reissues_per_rollout);
    EXPECT_GE(outcome.simulations_per_rollout, 1);
    EXPECT_LE(outcome.simulations_per_rollout, 1.05);
    return outcome;
  }

  void expect_one_result_at_any_loss(const std::string& text) {
    const std::filesystem::path study = service_.study(text);
    const Files files = learnt_alone(study);
    for (const int percent : {0, 10, 30}) learn_under_loss(study, files, percent);
  }

  static constexpr int kNumRuns = 30;

 private:
  int num_learnt_ = 0;
};

}  // namespace treeroll::end_to_end
