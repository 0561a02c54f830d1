#include "learner/report/statistics/claim.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>

#include "common/base/check.h"
#include "learner/report/statistics/sample.h"
#include "learner/report/statistics/tests_of_means.h"

namespace treeroll::report {
namespace {

constexpr double kLevel = .05;

using Values = std::vector<double>;

std::string means_text(const std::vector<Sample>& samples) {
  std::vector<std::string> parts;
  for (const Sample& sample : samples) {
    parts.push_back(fmt::format("{} {:.3g}", sample.label, *mean(sample.present())));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

/// What counts where numbers are counted: a fit has one, whatever the repetitions.
Values evidence(const Sample& sample) {
  Values values = sample.present();
  if (sample.is_of_fit) values.resize(1);
  return values;
}

/// The same values, each greater by so much.
Values shifted(Values values, double by) {
  for (double& value : values) value += by;
  return values;
}

/// The interval of a difference that was taken from values shifted by so much.
Interval shifted(const Interval& interval, double by) {
  return {.low = interval.low + by, .high = interval.high + by};
}

std::string margin_text(double margin) {
  return margin == 0 ? "" : fmt::format("; margin {:g}", margin);
}

Verdict by_p(double p, double opposite_p) {
  if (p < kLevel) return Verdict::kHolds;
  return opposite_p < kLevel ? Verdict::kFails : Verdict::kInconclusive;
}

/// By where the 95 % interval of a figure lies.
Verdict by_interval(const Interval& interval, double low, double high) {
  if (interval.low >= low && interval.high <= high) return Verdict::kHolds;
  if (interval.high < low || interval.low > high) return Verdict::kFails;
  return Verdict::kInconclusive;
}

ClaimResult too_few(const std::string& needed = "two") {
  ClaimResult result;
  result.measured = fmt::format("fewer than {} repetitions", needed);
  return result;
}

ClaimResult greater(const Claim& claim, const std::vector<Sample>& samples) {
  const auto [a, b] = pairs(samples[0], samples[1]);
  const Values second = shifted(samples[1].present(), claim.margin);
  const auto welch = welch_greater(samples[0].present(), second);
  const auto paired = paired_greater(a, shifted(b, claim.margin));
  const auto& test = claim.paired ? paired : welch;
  if (!test) return too_few();
  ClaimResult result;
  result.p = test->p;
  result.interval = shifted(test->interval_95, claim.margin);
  result.verdict = by_p(test->p, 1 - test->p);
  result.measured = fmt::format("{}; difference {:+.3g}{}", means_text(samples),
                                test->difference + claim.margin, margin_text(claim.margin));
  if (!claim.paired) result.g = hedges_g(samples[0].present(), samples[1].present());
  if (result.g) result.measured += fmt::format(", g {:.2f}", *result.g);
  if (paired && !claim.paired) result.measured += fmt::format("; paired p {:.2g}", paired->p);
  return result;
}

/// It does not hold if any pair is apart by more than the margin, in either direction, by Holm's
/// correction over the pairs: of one pair, if its 95 % interval lies beyond the margin.
ClaimResult equal_within(const Claim& claim, const std::vector<Sample>& samples) {
  ClaimResult result;
  result.p = 0;
  result.measured = fmt::format("{}; margin {:g}", means_text(samples), claim.margin);
  double widest = -1;
  Values apart;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t j = i + 1; j < samples.size(); ++j) {
      const Values a = samples[i].present();
      const Values b = samples[j].present();
      const auto p = equivalent_p(a, b, claim.margin);
      const auto test = welch_greater(a, b);
      const auto above = welch_greater(a, shifted(b, claim.margin));
      const auto below = welch_greater(b, shifted(a, claim.margin));
      if (!p || !test || !above || !below) return too_few();
      result.p = std::max(*result.p, *p);
      apart.push_back(std::min(1.0, 2 * std::min(above->p, below->p)));
      if (std::abs(test->difference) > widest) {
        widest = std::abs(test->difference);
        result.interval = test->interval_95;
      }
    }
  }
  const Values adjusted = holm(apart);
  result.verdict = by_p(*result.p, *std::min_element(adjusted.begin(), adjusted.end()));
  return result;
}

/// By exact intervals of the medians: two bounds that are each wrong in 2.5 % bound a difference in
/// 95 %, from either side.
ClaimResult equal_medians(const Claim& claim, const std::vector<Sample>& samples) {
  std::vector<Interval> intervals;
  std::vector<std::string> medians;
  for (const Sample& sample : samples) {
    const auto interval = median_interval_95(sample.present());
    if (!interval) return too_few("six");
    intervals.push_back(*interval);
    medians.push_back(fmt::format("{} {:.3g}", sample.label, *median(sample.present())));
  }
  ClaimResult result;
  result.verdict = Verdict::kHolds;
  result.measured = fmt::format("medians {}; margin {:g}", fmt::join(medians, ", "), claim.margin);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t j = i + 1; j < samples.size(); ++j) {
      const Interval apart = {.low = intervals[i].low - intervals[j].high,
                              .high = intervals[i].high - intervals[j].low};
      const Verdict verdict = by_interval(apart, -claim.margin, claim.margin);
      if (verdict == Verdict::kFails ||
          (verdict == Verdict::kInconclusive && result.verdict == Verdict::kHolds)) {
        result.verdict = verdict;
      }
      const auto reach = [](const Interval& interval) {
        return std::max(-interval.low, interval.high);
      };
      if (!result.interval || reach(apart) > reach(*result.interval)) result.interval = apart;
    }
  }
  return result;
}

/// The first above (sign 1) or below (sign -1) every other by the margin. It is not if another one
/// is on the wrong side of it, by Holm's correction over the others.
ClaimResult extreme(const Claim& claim, const std::vector<Sample>& samples, double sign) {
  ClaimResult result;
  result.p = 0;
  result.measured = means_text(samples) + margin_text(claim.margin);
  Values opposite;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const Values first = samples[0].present();
    const Values other = shifted(samples[i].present(), sign * claim.margin);
    const auto test = sign > 0 ? welch_greater(first, other) : welch_greater(other, first);
    if (!test) return too_few();
    opposite.push_back(1 - test->p);
    if (i == 1 || test->p > *result.p) {
      result.p = test->p;
      result.interval = shifted(test->interval_95, claim.margin);
      if (sign < 0)
        result.interval = {.low = -result.interval->high, .high = -result.interval->low};
    }
  }
  const Values adjusted = holm(opposite);
  result.verdict = by_p(*result.p, *std::min_element(adjusted.begin(), adjusted.end()));
  return result;
}

/// Numbers without chance: they grow, or they do not.
ClaimResult ordered_fits(const std::vector<Sample>& samples, bool growing_wanted) {
  const auto is_out_of_order = [&](const Sample& before, const Sample& after) {
    const double step = *after.values.front() - *before.values.front();
    return growing_wanted ? step <= 0 : step >= 0;
  };
  const bool holds = std::ranges::adjacent_find(samples, is_out_of_order) == samples.end();
  ClaimResult result;
  result.p = holds ? 0 : 1;
  result.verdict = holds ? Verdict::kHolds : Verdict::kFails;
  result.measured = means_text(samples);
  return result;
}

ClaimResult ordered(const std::vector<Sample>& samples, bool growing_wanted) {
  if (std::ranges::all_of(samples, &Sample::is_of_fit)) {
    return ordered_fits(samples, growing_wanted);
  }
  std::vector<Values> groups;
  std::vector<std::string> medians;
  for (const Sample& sample : samples) {
    groups.push_back(evidence(sample));
    medians.push_back(fmt::format("{} {:.3g}", sample.label, *median(groups.back())));
  }
  if (!growing_wanted) std::reverse(groups.begin(), groups.end());
  const auto trend = growing(groups);
  if (!trend) return too_few();
  ClaimResult result;
  result.p = trend->p;
  result.verdict = by_p(trend->p, 1 - trend->p);
  result.measured = fmt::format("medians {}; rank correlation {:.2f}", fmt::join(medians, ", "),
                                growing_wanted ? trend->correlation : -trend->correlation);
  return result;
}

ClaimResult share(const Claim& claim, const std::vector<Sample>& samples) {
  int inside = 0;
  int count = 0;
  for (const Sample& sample : samples) {
    for (const double value : evidence(sample)) {
      ++count;
      if (value >= claim.low && value <= claim.high) ++inside;
    }
  }
  ClaimResult result;
  const double seen = static_cast<double>(inside) / count;
  result.interval = std::ranges::all_of(samples, &Sample::is_of_fit)
                        ? Interval{.low = seen, .high = seen}
                        : share_interval_95(inside, count);
  result.verdict = by_interval(*result.interval, claim.share_min, claim.share_max);
  result.measured = fmt::format("{} of {} in [{:g}, {:g}]", inside, count, claim.low, claim.high);
  return result;
}

ClaimResult within(const Claim& claim, const std::vector<Sample>& samples) {
  ClaimResult result;
  result.interval = mean_interval_95(samples[0].present());
  if (!result.interval) return too_few();
  result.verdict = by_interval(*result.interval, claim.low, claim.high);
  result.measured =
      fmt::format("{}; claimed [{:g}, {:g}]", means_text(samples), claim.low, claim.high);
  return result;
}

ClaimResult deviation_within(const Claim& claim, const std::vector<Sample>& samples) {
  const Values values = samples[0].present();
  ClaimResult result;
  result.interval = deviation_interval_95(values);
  if (!result.interval) return too_few();
  result.verdict = by_interval(*result.interval, claim.low, claim.high);
  result.measured = fmt::format("{}, standard deviation {:.3g}; claimed [{:g}, {:g}]",
                                means_text(samples), *deviation(values), claim.low, claim.high);
  return result;
}

/// Of the conditions of one repetition, largest minus smallest; repetitions that lack one are out.
Values spreads(const std::vector<Sample>& samples) {
  Values result;
  for (std::size_t repetition = 0; repetition < samples[0].values.size(); ++repetition) {
    Values row;
    for (const Sample& sample : samples) {
      if (repetition < sample.values.size() && sample.values[repetition]) {
        row.push_back(*sample.values[repetition]);
      }
    }
    if (row.size() != samples.size()) continue;
    const auto [low, high] = std::minmax_element(row.begin(), row.end());
    result.push_back(*high - *low);
  }
  return result;
}

ClaimResult spread(const std::vector<Sample>& first, const std::vector<Sample>& second) {
  CHECK(first.size() == second.size(), "ranges over unequal numbers of conditions");
  const auto test = welch_greater(spreads(first), spreads(second));
  if (!test) return too_few();
  ClaimResult result;
  result.p = test->p;
  result.interval = test->interval_95;
  result.verdict = by_p(test->p, 1 - test->p);
  result.measured = fmt::format(
      "largest minus smallest within a repetition: {:.3g} against {:.3g} over {} and {}",
      *mean(spreads(first)), *mean(spreads(second)), means_text(first), means_text(second));
  return result;
}

ClaimResult judge_samples(const Claim& claim, const std::vector<Sample>& samples,
                          const std::vector<Sample>& others) {
  switch (claim.kind) {
    case ClaimKind::kGreater:
      return greater(claim, samples);
    case ClaimKind::kEqualWithin:
      return equal_within(claim, samples);
    case ClaimKind::kEqualMedians:
      return equal_medians(claim, samples);
    case ClaimKind::kHighest:
      return extreme(claim, samples, 1);
    case ClaimKind::kLowest:
      return extreme(claim, samples, -1);
    case ClaimKind::kGrowing:
      return ordered(samples, true);
    case ClaimKind::kFalling:
      return ordered(samples, false);
    case ClaimKind::kShare:
      return share(claim, samples);
    case ClaimKind::kWithin:
      return within(claim, samples);
    case ClaimKind::kDeviation:
      return deviation_within(claim, samples);
    case ClaimKind::kSpread:
      return spread(samples, others);
  }
  CHECK(false, "a ClaimKind outside its enumeration");
}

}  // namespace

std::string_view name(ClaimKind kind) {
  const auto found =
      std::ranges::find(kClaimKinds, kind, [](const auto& named) { return named.second; });
  CHECK(found != kClaimKinds.end(), "a ClaimKind outside its enumeration");
  return found->first;
}

std::string describe(const Claim& claim) {
  const std::string first = describe(claim.measure);
  const bool has_others = claim.conditions.size() > 1 || !claim.others.empty();
  if (!has_others || claim.against == claim.measure) return first;
  return first + " (the first), " + describe(claim.against) +
         (claim.conditions.size() == 2 ? " (the second)" : " (the others)");
}

std::string name(Verdict verdict) {
  switch (verdict) {
    case Verdict::kHolds:
      return "holds";
    case Verdict::kFails:
      return "does not hold";
    case Verdict::kInconclusive:
      return "inconclusive";
    case Verdict::kNotMeasured:
      return "not measured";
  }
  CHECK(false, "a Verdict outside its enumeration");
}

bool needs_log_likelihoods(const Claim& claim, const std::string& study) {
  const auto is_fit = [&](const std::string& condition, const Measure& measure) {
    return measure.kind == MeasureKind::kLogLikelihood &&
           parse_condition(claim.study, condition).study == study;
  };
  bool found = false;
  for (std::size_t i = 0; i < claim.conditions.size(); ++i) {
    found = found || is_fit(claim.conditions[i], i == 0 ? claim.measure : claim.against);
  }
  for (const std::string& other : claim.others) found = found || is_fit(other, claim.against);
  return found;
}

ClaimResult judge(const Claim& claim, const std::vector<StudyResults>& studies) {
  std::vector<Sample> samples;
  std::vector<Sample> others;
  std::vector<std::string> counts;
  const auto take = [&](const std::string& condition, const Measure& measure,
                        std::vector<Sample>& into) -> std::string {
    Result<Sample> sample = find_sample(studies, claim.study, condition, measure);
    if (!sample) return sample.error().message;
    const std::size_t present = sample->present().size();
    if (present == 0) {
      return fmt::format("{}: no run has a {}", sample->label, describe(measure));
    }
    const std::size_t num = evidence(*sample).size();
    counts.push_back(present == sample->values.size()
                         ? std::to_string(num)
                         : fmt::format("{} of {}", num, sample->values.size()));
    into.push_back(*std::move(sample));
    return "";
  };
  std::string lack;
  for (std::size_t i = 0; i < claim.conditions.size() && lack.empty(); ++i) {
    lack = take(claim.conditions[i], i == 0 ? claim.measure : claim.against, samples);
  }
  for (std::size_t i = 0; i < claim.others.size() && lack.empty(); ++i) {
    lack = take(claim.others[i], claim.against, others);
  }
  if (!lack.empty())
    return {.verdict = Verdict::kNotMeasured, .measured = lack, .n = "", .p = {}, .interval = {}};
  ClaimResult result = judge_samples(claim, samples, others);
  const bool all_equal = std::all_of(counts.begin(), counts.end(),
                                     [&](const std::string& count) { return count == counts[0]; });
  result.n = all_equal ? counts[0] : fmt::format("{}", fmt::join(counts, ", "));
  return result;
}

std::vector<std::optional<double>> adjusted_p(const std::vector<ClaimResult>& results) {
  std::vector<std::optional<double>> p;
  for (const ClaimResult& result : results) p.push_back(result.p);
  return holm_of_present(p);
}

}  // namespace treeroll::report
