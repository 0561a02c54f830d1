#include "learner/results/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "common/files/atomic_file.h"
#include "learner/results/run_counts.h"

namespace treeroll {
namespace {

/// By run number, which is condition * repetitions + repetition.
std::vector<const RunRecord*> sorted(const std::vector<RunRecord>& runs) {
  std::vector<const RunRecord*> by_number;
  by_number.reserve(runs.size());
  for (const RunRecord& run : runs) by_number.push_back(&run);
  std::stable_sort(by_number.begin(), by_number.end(),
                   [](const RunRecord* a, const RunRecord* b) { return a->run < b->run; });
  return by_number;
}

}  // namespace

std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

void write_rollouts_csv(const std::filesystem::path& path, const std::vector<RunRecord>& runs) {
  AtomicFile file(path);
  file.append("condition,repetition,run,rollout,layer,reward,status\n");
  for (const RunRecord* run : sorted(runs)) {
    const std::string prefix =
        fmt::format("{},{},{}", csv_field(run->condition), run->repetition, run->run);
    for (std::size_t number = 0; number < run->rollouts.size(); ++number) {
      const RolloutRecord& rollout = run->rollouts[number];
      if (!is_applied(rollout)) continue;
      file.append(fmt::format("{},{},{},{},{}\n", prefix, number, rollout.layer, rollout.reward,
                              name(rollout.status)));
    }
  }
  file.commit();
}

void write_runs_csv(const std::filesystem::path& path, const std::vector<RunRecord>& runs) {
  AtomicFile file(path);
  file.append(
      "condition,repetition,run,rollouts,best_reward,final_reward,rollouts_before_switch,failed,"
      "switches\n");
  for (const RunRecord* run : sorted(runs)) {
    std::string row = fmt::format("{},{},{},{},", csv_field(run->condition), run->repetition,
                                  run->run, num_applied(*run));
    const auto out = std::back_inserter(row);
    if (run->best_rollout >= 0) fmt::format_to(out, "{}", run->best_reward);
    row += ',';
    if (run->final_reward) fmt::format_to(out, "{}", *run->final_reward);
    row += ',';
    for (std::size_t i = 0; i < run->switches.size(); ++i) {
      fmt::format_to(out, "{}{}", i == 0 ? "" : ";", rollouts_before(run->switches[i]));
    }
    fmt::format_to(out, ",{},{}\n", num_failed(*run), run->switches.size());
    file.append(row);
  }
  file.commit();
}

}  // namespace treeroll
