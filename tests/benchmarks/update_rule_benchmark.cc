#include <benchmark/benchmark.h>

#include "common/numbers/elementary.h"
#include "learner/explore/cma_es_rule.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/layer_search.h"
#include "learner/explore/pi2_rule.h"
#include "learner/explore/power_rule.h"

namespace treeroll::benchmarks {
namespace {

using explore::LayerSearch;

/// One result after the other: its perturbation, and what is learnt from it. A population rule
/// updates once a generation; the time is the mean over all its results.
/// Argument: elements of theta.
void draw_and_learn(benchmark::State& state, const explore::RuleSettings& rule) {
  const auto n = static_cast<Eigen::Index>(state.range(0));
  explore::ExplorationSettings settings;
  settings.rule = rule;
  const Eigen::VectorXd variance = Eigen::VectorXd::Constant(n, .04);
  const auto fresh = [&] {
    return LayerSearch(settings, {{Eigen::VectorXd::Zero(n), variance.asDiagonal()}, variance, {}});
  };
  // A search that has converged has a noise of its own kind: begun anew as a study would.
  constexpr int kResultsOfALayer = 1000;
  std::optional<LayerSearch> search;
  int number = kResultsOfALayer;
  for (auto _ : state) {
    if (number == kResultsOfALayer) {
      search.emplace(fresh());
      number = 0;
    }
    const auto [theta, from] = search->draw(
        RandomStream(1, 0, static_cast<std::uint32_t>(number), RandomPurpose::kPerturbation));
    const double miss = (theta.array() - .3).matrix().squaredNorm() / static_cast<double>(n);
    search->learn({{number, elementary::exp(-miss), theta}, from}, number + 1);
    ++number;
  }
}

#define TREEROLL_RULE_BENCHMARK(name, settings)     \
  BENCHMARK_CAPTURE(draw_and_learn, name, settings) \
      ->Name("update_rule/" #name)                  \
      ->ArgName("n")                                \
      ->Arg(6)                                      \
      ->Arg(12)                                     \
      ->Arg(50)

TREEROLL_RULE_BENCHMARK(power, explore::PowerSettings{});
TREEROLL_RULE_BENCHMARK(pi2, explore::Pi2Settings{});
TREEROLL_RULE_BENCHMARK(cma_es, explore::CmaEsRuleSettings{});

}  // namespace
}  // namespace treeroll::benchmarks
