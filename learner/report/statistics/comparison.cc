#include "learner/report/statistics/comparison.h"

#include <algorithm>
#include <cstddef>

namespace treeroll::report {
namespace {

Sample end_rewards(const std::string& label, const std::vector<MeasuredRun>& runs) {
  Sample sample{.label = label, .values = {}};
  for (const MeasuredRun& run : runs) sample.values.push_back(measure(run, {}));
  return sample;
}

std::vector<double> rewards_at(const std::vector<MeasuredRun>& runs, int rollout) {
  std::vector<double> rewards;
  for (const MeasuredRun& run : runs) {
    if (const std::optional<double> reward = run.reward(rollout)) rewards.push_back(*reward);
  }
  return rewards;
}

int longest(const std::vector<MeasuredRun>& runs) {
  int length = 0;
  for (const MeasuredRun& run : runs) length = std::max(length, run.num_rollouts());
  return length;
}

}  // namespace

Comparison compare(const std::string& label_a, const std::vector<MeasuredRun>& a,
                   const std::string& label_b, const std::vector<MeasuredRun>& b,
                   bool share_draws) {
  const Sample end_a = end_rewards(label_a, a);
  const Sample end_b = end_rewards(label_b, b);
  Comparison comparison;
  comparison.a = label_a;
  comparison.b = label_b;
  comparison.num_a = static_cast<int>(end_a.present().size());
  comparison.num_b = static_cast<int>(end_b.present().size());
  comparison.mean_a = mean(end_a.present());
  comparison.mean_b = mean(end_b.present());
  comparison.end = welch_greater(end_a.present(), end_b.present());
  if (share_draws) {
    const auto [first, second] = pairs(end_a, end_b);
    comparison.paired = paired_greater(first, second);
  }
  comparison.g = hedges_g(end_a.present(), end_b.present());
  for (int i = 0; i < std::min(longest(a), longest(b)); ++i) {
    const auto test = welch_greater(rewards_at(a, i), rewards_at(b, i));
    comparison.p.push_back(test ? std::optional(test->p) : std::nullopt);
  }
  comparison.p_holm = holm_of_present(comparison.p);
  return comparison;
}

std::vector<std::optional<double>> adjusted_p(const std::vector<Comparison>& comparisons) {
  std::vector<std::optional<double>> p;
  for (const Comparison& comparison : comparisons) {
    p.push_back(comparison.end ? std::optional(comparison.end->p) : std::nullopt);
  }
  return holm_of_present(p);
}

std::vector<Comparison::ByRollout> family_wise(const std::vector<Comparison>& comparisons) {
  Comparison::ByRollout family;
  for (const Comparison& comparison : comparisons) {
    for (const auto& p : comparison.p) {
      family.push_back(p ? std::optional(two_sided(*p)) : std::nullopt);
    }
  }
  const Comparison::ByRollout adjusted = holm_of_present(family);
  std::vector<Comparison::ByRollout> all;
  auto next = adjusted.begin();
  for (const Comparison& comparison : comparisons) {
    const auto end = next + static_cast<std::ptrdiff_t>(comparison.p.size());
    all.emplace_back(next, end);
    next = end;
  }
  return all;
}

}  // namespace treeroll::report
