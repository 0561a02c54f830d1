#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "learner/report/statistics/measure.h"
#include "learner/results/statistics.h"
#include "learner/results/study_results.h"

namespace treeroll::report {

/// What a claim says of its conditions' measure, and how that is tested at the level of 5 %:
enum class ClaimKind {
  kGreater,       ///< first > second + `margin`: one-sided Welch, or paired
  kEqualWithin,   ///< all differ by less than `margin`: TOST of every pair, the largest p
  kEqualMedians,  ///< the medians do: intervals of every pair's difference
  kHighest,       ///< first > every other + `margin`: the largest p of the one-sided tests
  kLowest,        ///< first < every other - `margin`
  kGrowing,       ///< grows from condition to condition: Spearman's trend
  kFalling,
  kShare,      ///< the share of runs whose measure is in [low, high] is in [share_min, share_max]
  kWithin,     ///< mean in [low, high], by its 95 % interval
  kDeviation,  ///< standard deviation over the runs in [low, high], by its 95 % interval
  kSpread,     ///< within a repetition `conditions` are further apart, largest less smallest, than
               ///< `others`: one-sided Welch on these ranges. A range grows with the number of
               ///< conditions, so both are equally many
};

/// As a claims file names them.
inline constexpr std::array<std::pair<std::string_view, ClaimKind>, 11> kClaimKinds{{
    {"greater", ClaimKind::kGreater},
    {"equal_within", ClaimKind::kEqualWithin},
    {"equal_medians", ClaimKind::kEqualMedians},
    {"highest", ClaimKind::kHighest},
    {"lowest", ClaimKind::kLowest},
    {"growing", ClaimKind::kGrowing},
    {"falling", ClaimKind::kFalling},
    {"share", ClaimKind::kShare},
    {"within", ClaimKind::kWithin},
    {"deviation", ClaimKind::kDeviation},
    {"spread", ClaimKind::kSpread},
}};
std::string_view name(ClaimKind kind);

/// A row of a claims file.
struct Claim {
  std::string text;
  std::string section;  ///< where it is made: "4-1-2"
  ClaimKind kind = ClaimKind::kGreater;
  std::string study;                    ///< of conditions that name none
  std::vector<std::string> conditions;  ///< CONDITION or STUDY:CONDITION
  std::vector<std::string> others;      ///< of kSpread, as many as `conditions`
  Measure measure;                      ///< of the first condition
  Measure against;                      ///< of the others
  bool paired = false;                  ///< kGreater: by repetition
  double margin = 0;  ///< negative, of kGreater: first is not below second by more than that
  double low = 0;
  double high = 0;
  double share_min = 0;
  double share_max = 1;
  std::string figure;  ///< id of one that shows it; empty: curves, or switches if it is about them
};

/// Its measures in words, that of the conditions after the first too where it is another one.
std::string describe(const Claim& claim);

enum class Verdict { kHolds, kFails, kInconclusive, kNotMeasured };
/// holds, does not hold, inconclusive, not measured.
std::string name(Verdict verdict);

struct ClaimResult {
  Verdict verdict = Verdict::kNotMeasured;
  std::string measured;          ///< figures in words, or why there are none
  std::string n;                 ///< repetitions that have the measure: "30, 30"; "29 of 30, 30"
  std::optional<double> p;       ///< of the claim; small speaks for it
  std::optional<double> g = {};  ///< Hedges', of kGreater that is not paired
  std::optional<Interval> interval;  ///< 95 %, of the difference, mean or share that counts
};

/// Whether it is about the fits of this study: of which judge() needs the log-likelihoods.
bool needs_log_likelihoods(const Claim& claim, const std::string& study);

/// Does not throw for what is not there: a study, a condition, a roll-out not given make the claim
/// "not measured" and `measured` says what lacks.
ClaimResult judge(const Claim& claim, const std::vector<StudyResults>& studies);

/// Holm's adjusted p of each claim that has a p, over all of them; nothing for the others.
std::vector<std::optional<double>> adjusted_p(const std::vector<ClaimResult>& results);

}  // namespace treeroll::report
