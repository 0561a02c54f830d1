#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <vector>

#include "tests/thesis/run_study.h"
#include "tests/thesis/studies.h"

/// Section 2-1: a policy maps states to actions, (2-1). The experiments of the thesis map time to
/// an action; here the inputs are six states, in a closed loop.
namespace treeroll {
namespace {

std::vector<RunRecord> learn_hold(std::vector<std::string> overrides) {
  overrides.emplace_back("study.seed=2");
  return run_study(kStudies / "hold.toml", overrides);
}

TEST(ClosedLoopLearningTest, Section21AFeedbackFromTheStateIsLearntFromNothing) {
  // Draws with next to no noise are the start policy, which does nothing.
  const std::vector<RunRecord> start = learn_hold(
      {"study.repetitions=1", "study.rollouts=5", "exploration.initial_noise_factor=1e-12"});
  const std::vector<RunRecord> runs = learn_hold({"study.repetitions=3", "study.rollouts=300"});
  for (const char* condition : {"linear", "flat", "tree"}) {
    const std::vector<RunRecord> of = of_condition(runs, condition);
    const double before = mean_near(of_condition(start, condition), 5);
    const double after = mean_near(of, 300);
    std::printf("  %-6s start %.3f, mean best %.3f, near roll-out 300 %.3f\n", condition, before,
                mean_best(of), after);
    EXPECT_GT(after, before + .3) << condition;
    for (const RunRecord& run : of) {
      EXPECT_GT(run.best_reward, before + .3) << condition << ", repetition " << run.repetition;
    }
    EXPECT_LT(mean_near(of, 5), before + .1)
        << condition << ": it does not begin with what it learns";
  }
}

}  // namespace
}  // namespace treeroll
