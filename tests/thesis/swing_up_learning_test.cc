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
        kStudies / "thesis_4_3.toml",
        {R"(axes=[{options=[{name="rk4", task={plant="rk4", step_s=0.005}}]}])", "study.seed=2"});
    return runs;
  }
};

TEST_F(SwingUpLearningTest, Section432TheMeansOfTheBestRewardsComeOut) {
  EXPECT_NEAR(mean_best(of_condition(runs(), "flat.rk4")), .71, .1);
  EXPECT_NEAR(mean_best(of_condition(runs(), "layer_1.rk4")), .61, .1);
  EXPECT_NEAR(mean_best(of_condition(runs(), "layer_2.rk4")), .61, .1);
  EXPECT_NEAR(mean_best(of_condition(runs(), "tree.rk4")), .63, .1);
}

TEST_F(SwingUpLearningTest, Section432NoneOfTheMethodsIsGuaranteedToGiveAWorkingController) {
  for (const char* condition : {"flat.rk4", "layer_1.rk4", "layer_2.rk4", "tree.rk4"}) {
    double worst = 1;
    for (const RunRecord& run : of_condition(runs(), condition)) {
      worst = std::min(worst, run.best_reward);
    }
    EXPECT_LT(worst, .9) << condition;
  }
}

TEST_F(SwingUpLearningTest, Section432LayersOneAndTwoConvergeToAboutTheSameReward) {
  EXPECT_NEAR(mean_best(of_condition(runs(), "layer_1.rk4")),
              mean_best(of_condition(runs(), "layer_2.rk4")), .05);
}

}  // namespace
}  // namespace treeroll
