#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "learner/results/run_counts.h"
#include "tests/thesis/run_study.h"
#include "tests/thesis/studies.h"

/// How far the update rules come on the swing-up, equations of motion, tuned settings, 100 seeds:
/// what an independent implementation of each reached, with a margin for another draw of seeds.
namespace treeroll {
namespace {

std::vector<double> best_after(const std::vector<RunRecord>& runs, std::size_t num_rollouts) {
  std::vector<double> best;
  for (const RunRecord& run : runs) {
    double highest = 0;
    for (std::size_t i = 0; i < std::min(num_rollouts, run.rollouts.size()); ++i) {
      if (is_applied(run.rollouts[i])) highest = std::max(highest, run.rollouts[i].reward);
    }
    best.push_back(highest);
  }
  return best;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// Of those that can be caught upright.
int num_swung_up(const std::vector<double>& best) {
  return static_cast<int>(
      std::count_if(best.begin(), best.end(), [](double reward) { return reward >= .99; }));
}

TEST(SwingUpRulesTest, PopulationRulesReachTheSwingUpWithinAThousandRollouts) {
  const std::vector<RunRecord> runs =
      run_study(kStudies / "swing_up_rules.toml",
                {"study.repetitions=100", "study.rollouts=1000", "study.seed=2"});
  const auto pi2 = of_condition(runs, "pi2");
  EXPECT_GE(mean_of(best_after(pi2, 200)), .97);
  EXPECT_GE(num_swung_up(best_after(pi2, 1000)), 95);
  const auto cem = of_condition(runs, "cem");
  EXPECT_GE(mean_of(best_after(cem, 200)), .965);
  const auto cma_es = of_condition(runs, "cma_es");
  EXPECT_GE(mean_of(best_after(cma_es, 200)), .975);
  EXPECT_EQ(num_swung_up(best_after(cma_es, 700)), 100);
  for (const char* rule : {"power", "pi2", "cem", "cma_es"}) {
    const auto of_rule = of_condition(runs, rule);
    std::printf(
        "  %-7s mean best at 200 %.4f, at 1000 %.4f; .99 reached by 200 / 700 / 1000: %d / %d / "
        "%d\n",
        rule, mean_of(best_after(of_rule, 200)), mean_of(best_after(of_rule, 1000)),
        num_swung_up(best_after(of_rule, 200)), num_swung_up(best_after(of_rule, 700)),
        num_swung_up(best_after(of_rule, 1000)));
  }
}

TEST(SwingUpRulesTest, TunedPowerComesCloseInTwoThousand) {
  const std::vector<RunRecord> runs = run_study(
      kStudies / "swing_up_rules.toml",
      {"study.repetitions=100", "study.rollouts=2000", "study.seed=2",
       R"(conditions=[{name="power", exploration={rule="power", noise_variance=[0.01, 0.3, 0.02], )"
       R"(initial_noise_factor=0.03, minimum_noise_fraction=0.005, minimum_noise_decay_start=50, )"
       R"(first_update=10, best_considered=5}}])"});
  std::printf("  power   mean best at 200 %.4f, at 2000 %.4f\n", mean_of(best_after(runs, 200)),
              mean_of(best_after(runs, 2000)));
  EXPECT_GE(mean_of(best_after(runs, 200)), .93);
  EXPECT_GE(mean_of(best_after(runs, 2000)), .98);
}

TEST(SwingUpRulesTest, CmaEsReachesItWithEightInFlight) {
  const std::vector<RunRecord> runs = run_study(
      kStudies / "swing_up_rules.toml",
      {"study.repetitions=100", "study.rollouts=700", "study.in_flight=8", "study.seed=2",
       R"(conditions=[{name="cma_es", exploration={rule="cma_es", coordinates="sensitivity", )"
       R"(initial_step=0.03, population=12, rate_factor=5.0, generation="stale"}}])"});
  std::printf("  cma_es, 8 in flight: mean best at 200 %.4f; .99 reached by 700: %d\n",
              mean_of(best_after(runs, 200)), num_swung_up(best_after(runs, 700)));
  EXPECT_GE(mean_of(best_after(runs, 200)), .975);
  EXPECT_EQ(num_swung_up(best_after(runs, 700)), 100);
}

}  // namespace
}  // namespace treeroll
