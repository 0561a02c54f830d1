#include "learner/study/study_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>

#include "common/protocol/limits.h"
#include "common/settings/settings_reader.h"
#include "learner/core/numeric_classes.h"

namespace treeroll {
namespace {

constexpr std::size_t kStudyNameBytesMax = 64;
constexpr std::int64_t kFinalEvaluationsMax = 1000;
constexpr std::int64_t kDiscardsMax = 1000;
/// A lesser share would be of no roll-out at all.
constexpr double kRecheckMin = 1e-6;
/// Three years: far from where nanoseconds overflow.
constexpr double kStopAfterMaxS = 1e8;

/// It becomes the name of a folder.
void check_study_name(const SettingsReader& reader, const std::string& name) {
  const auto usable = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("_-.").find(c) != std::string_view::npos;
  };
  const bool starts_well = !name.empty() && name[0] != '.' && name[0] != '-';
  if (starts_well && name.size() <= kStudyNameBytesMax &&
      std::all_of(name.begin(), name.end(), usable)) {
    return;
  }
  reader.refuse("name", fmt::format("must be 1 to {} letters, digits and _ . -, and begin with "
                                    "none of . and -",
                                    kStudyNameBytesMax));
}

}  // namespace

StudyBudget read_study_table(SettingsReader& reader, Study& study) {
  study.name = reader.string(
      "name", {},
      {.meaning =
           "Names the folder of the results; 1 to 64 letters, digits and _ . -, not beginning "
           "with . or -",
       .example = "\"my_study\""});
  check_study_name(reader, study.name);
  study.seed = static_cast<std::uint64_t>(
      reader.integer("seed", 0, std::numeric_limits<std::int64_t>::max(), 1,
                     {.meaning = "Of all random numbers", .rule = "0 to 2^63 - 1"}));
  study.repetitions = static_cast<int>(
      reader.integer("repetitions", 1, protocol::kRunsMax, 1,
                     {.meaning = "Runs of each condition, with the same random numbers in each "
                                 "condition; all runs together are at most 100000"}));
  study.in_sequence =
      reader.choice("order", {"sequence", "arrival"}, "sequence",
                    {.meaning = "Results are applied by number: one outcome, whatever the workers "
                                "do; or as they come"}) == "sequence";
  study.numeric_class = reader.string(
      "numeric_class", learner::kAnyClass,
      {.meaning =
           "Of which workers results are taken: \"any\"; \"one\", that of the first result; or "
           "the name of a class, as treeroll-replay shows it"});
  if (study.numeric_class.empty() || study.numeric_class.size() > protocol::kNumericClassBytesMax) {
    reader.refuse("numeric_class",
                  "must be \"any\", \"one\" or the name of a class, as replay shows it");
  }
  const auto stop_after_s = reader.optional_number(
      "stop_after_s", {.min = 1e-3, .max = kStopAfterMaxS},
      {.meaning = "The study ends after so much time of learning, whatever its runs have come to",
       .unit = "s"});
  if (stop_after_s) study.stop_after = std::chrono::nanoseconds(std::llround(*stop_after_s * 1e9));
  study.final_evaluations = static_cast<int>(
      reader.integer("final_evaluations", 1, kFinalEvaluationsMax, 1,
                     {.meaning = "Evaluations of each run's final mean policy, each with a seed of "
                                 "its own; for tasks that are not deterministic"}));
  study.discards_max = static_cast<int>(
      reader.integer("discards_max", 0, kDiscardsMax, Study{}.discards_max,
                     {.meaning = "Trials of one roll-out that its task may discard; one more ends "
                                 "the run. One that nobody answered does not count"}));
  study.recheck =
      reader
          .optional_number("recheck", {.min = kRecheckMin, .max = 1},
                           {.meaning = "Share of roll-outs that one more worker evaluates, drawn "
                                       "from the seed: its answers are compared, and nothing is "
                                       "learnt from them"})
          .value_or(0);
  StudyBudget budget;
  budget.num_rollouts = static_cast<int>(reader.integer(
      "rollouts", 1, protocol::kRolloutsMax, {},
      {.meaning = "Of each run; of all runs together at most 1e8", .example = "150"}));
  budget.in_flight =
      static_cast<int>(reader.integer("in_flight", 1, protocol::kInFlightMax, 1,
                                      {.meaning = "Roll-outs of a run that workers have at once"}));
  return budget;
}

std::optional<std::string> read_start_file_name(SettingsReader& policy) {
  if (!policy.has("start_file")) return std::nullopt;
  std::string name = policy.string(
      "start_file", {},
      {.meaning =
           "A policy file to begin with, from its first layer on, policies/NAME.json of an "
           "earlier study say; relative to the study's folder. The other keys of [policy] are "
           "checked, but do not count then"});
  if (policy.has(kGivenPolicy)) policy.refuse("start_file", "must not stand beside policy.given");
  return name;
}

std::optional<std::string> read_given_policy(SettingsReader& policy) {
  if (!policy.has(kGivenPolicy)) return std::nullopt;
  return policy.string(kGivenPolicy, {},
                       {.meaning = "The text of a policy; a resolved study has it in place of "
                                   "start_file"});
}

}  // namespace treeroll
