#include <gtest/gtest.h>

#include <algorithm>

#include "tests/thesis/run_study.h"

/// Section 4-3-2: learning the swing-up with the settings of table 4-3. The figures are means over
/// repetitions of the best reward in 200 roll-outs, found independently with other random numbers.
namespace treeroll {
namespace {

const std::filesystem::path kStudies = TREEROLL_STUDIES_DIR;

class SwingUpLearningTest : public ::testing::Test {
 protected:
  static const std::vector<RunRecord>& runs() {
    // The equations of motion: their results and ODE's agree within .02, at a tenth of the time.
    static const std::vector<RunRecord> runs = run_study(
        kStudies / "thesis_4_3.toml", {"task.plant=rk4", "task.step_s=0.005", "study.seed=2"});
    return runs;
  }
};

TEST_F(SwingUpLearningTest, Section432TheMeansOfTheBestRewardsComeOut) {
  EXPECT_NEAR(mean_best(of_condition(runs(), "flat")), .71, .1);
  EXPECT_NEAR(mean_best(of_condition(runs(), "layer_1")), .61, .1);
  EXPECT_NEAR(mean_best(of_condition(runs(), "layer_2")), .61, .1);
  EXPECT_NEAR(mean_best(of_condition(runs(), "tree")), .63, .1);
}

TEST_F(SwingUpLearningTest, Section432NoneOfTheMethodsIsGuaranteedToGiveAWorkingController) {
  for (const char* condition : {"flat", "layer_1", "layer_2", "tree"}) {
    double worst = 1;
    for (const RunRecord& run : of_condition(runs(), condition)) {
      worst = std::min(worst, run.best_reward);
    }
    EXPECT_LT(worst, .9) << condition;
  }
}

TEST_F(SwingUpLearningTest, Section432LayersOneAndTwoConvergeToAboutTheSameReward) {
  EXPECT_NEAR(mean_best(of_condition(runs(), "layer_1")),
              mean_best(of_condition(runs(), "layer_2")), .05);
}

}  // namespace
}  // namespace treeroll
