#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "tests/learner_core/cluster.h"

namespace treeroll::learner {

inline constexpr protocol::WorkerId kStranger = 666;

inline std::vector<std::vector<double>> all_rewards(const LearnerCore& core) {
  std::vector<std::vector<double>> rewards;
  for (const RunRecord& run : core.run_records()) {
    rewards.emplace_back();
    for (const RolloutRecord& rollout : run.rollouts) rewards.back().push_back(rollout.reward);
  }
  return rewards;
}

struct Calm {
  std::vector<std::vector<double>> rewards;
  TimePoint end;
};

/// The same with nobody but workers 1 .. n.
inline Calm calm(const Study& study, int num_workers) {
  Cluster cluster(study);
  for (int id = 1; id <= num_workers; ++id) cluster.add_worker(id);
  cluster.start();
  cluster.run(std::chrono::seconds(1000));
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  return {all_rewards(*cluster.core), cluster.now};
}

inline auto says(const char* part) {
  return ::testing::Contains(::testing::Field(&LogLine::text, ::testing::HasSubstr(part)));
}

}  // namespace treeroll::learner
