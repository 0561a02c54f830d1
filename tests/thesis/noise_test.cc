#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/thesis/run_study.h"
#include "tests/thesis/studies.h"

/// Section 4-1-2: what the exploration noise does, on the trajectory with several resolutions.
namespace treeroll {
namespace {

std::vector<RunRecord> with(const std::vector<std::string>& settings) {
  std::vector<std::string> overrides{"study.seed=4"};
  for (const std::string& setting : settings) overrides.push_back("exploration." + setting);
  return run_study(kStudies / "thesis_4_1.toml", overrides);
}

double median_first_switch(const std::vector<RunRecord>& runs) {
  std::vector<int> switches;
  for (const RunRecord& run : runs) {
    switches.push_back(run.switches.empty() ? static_cast<int>(run.rollouts.size())
                                            : run.switches.front());
  }
  std::sort(switches.begin(), switches.end());
  return switches[switches.size() / 2];
}

TEST(NoiseTest, Section412ReuseOfExperiencePreventsTheDropAfterALargeInitialNoise) {
  const double with_reuse =
      mean_near(of_condition(with({"initial_noise_factor=5", "reuse=true"}), "multi.tree"), 100);
  const double without =
      mean_near(of_condition(with({"initial_noise_factor=5", "reuse=false"}), "multi.tree"), 100);
  EXPECT_GT(with_reuse, without);
}

TEST(NoiseTest, Section412TheLargestMinimumNoiseEndsLowestAndLargerOnesSwitchEarlier) {
  std::vector<double> flat;
  std::vector<double> tree;
  std::vector<double> switches;
  for (const char* fraction : {"1e-3", "2e-3", "5e-3", "1e-2", "2e-2", "5e-2"}) {
    const std::vector<RunRecord> runs =
        with({"initial_noise_factor=1", std::string("minimum_noise_fraction=") + fraction});
    flat.push_back(mean_near(of_condition(runs, "multi.flat"), 400));
    tree.push_back(mean_near(of_condition(runs, "multi.tree"), 400));
    switches.push_back(median_first_switch(of_condition(runs, "multi.tree")));
  }
  EXPECT_EQ(std::min_element(flat.begin(), flat.end()), flat.end() - 1);
  EXPECT_EQ(std::min_element(tree.begin(), tree.end()), tree.end() - 1);
  EXPECT_LT(switches.back(), switches.front());
}

}  // namespace
}  // namespace treeroll
