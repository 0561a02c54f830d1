#include "learner/results/recheck_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/base/for_log.h"

namespace treeroll {
namespace {

/// Of a cluster whose workers all differ the first ones tell enough.
constexpr std::size_t kWorkersSaidMax = 20;

std::string class_name(const std::string& name) {
  return name.empty() ? "not known" : for_log(name);
}

}  // namespace

std::vector<std::string> remarks(const RecheckRecord& record) {
  std::vector<std::string> said;
  if (record.num_rechecked == 0) return said;
  if (record.num_disputed == 0) {
    said.push_back(fmt::format("{} roll-outs were run again on another worker: all answers agree",
                               record.num_rechecked));
  } else {
    said.push_back(fmt::format(
        "{} of {} roll-outs that were run again on another worker have answers that differ{}",
        record.num_disputed, record.num_rechecked,
        record.num_undecided == 0
            ? ""
            : fmt::format("; of {} no two workers tell which is wrong", record.num_undecided)));
  }
  // Where some are outvoted, what others differ from is theirs.
  const bool has_outvoted = std::ranges::any_of(
      record.workers, [](const auto& each) { return each.second.num_outvoted > 0; });
  std::size_t num_said = 0;
  for (const auto& [id, tally] : record.workers) {
    const bool is_worth_a_word = has_outvoted ? tally.num_outvoted > 0 : tally.num_disagreed > 0;
    if (!is_worth_a_word || ++num_said > kWorkersSaidMax) continue;
    said.push_back(
        tally.num_outvoted > 0
            ? fmt::format("{} is contradicted by two others of its numeric class in {} roll-outs: "
                          "its results go to suspects.csv at the end, and treeroll-replay DIR "
                          "--without-worker {} --state-dir NEW folds the study without them",
                          described(tally.worker), tally.num_outvoted, id)
            : fmt::format("{} differs from others in {} of {} comparisons", described(tally.worker),
                          tally.num_disagreed, tally.num_compared));
  }
  for (const auto& [names, tally] : record.classes) {
    if (names.first == names.second || tally.num_disagreed == 0) continue;
    said.push_back(
        fmt::format("numeric classes {} and {} differ in {} of {} comparisons, by {:.3g} at most",
                    class_name(names.first), class_name(names.second), tally.num_disagreed,
                    tally.num_compared, tally.difference_max));
  }
  return said;
}

nlohmann::json to_json_value(const RecheckRecord& record) {
  nlohmann::json workers = nlohmann::json::array();
  for (const auto& [id, tally] : record.workers) {
    workers.push_back({{"id", std::to_string(id)},
                       {"host", tally.worker.host},
                       {"pid", tally.worker.pid},
                       {"numeric_class", tally.worker.numeric_class},
                       {"compared", tally.num_compared},
                       {"disagreed", tally.num_disagreed},
                       {"outvoted", tally.num_outvoted}});
  }
  nlohmann::json classes = nlohmann::json::array();
  for (const auto& [names, tally] : record.classes) {
    classes.push_back({{"classes", {names.first, names.second}},
                       {"compared", tally.num_compared},
                       {"disagreed", tally.num_disagreed},
                       {"difference_max", tally.difference_max}});
  }
  return {{"rechecked", record.num_rechecked},
          {"disputed", record.num_disputed},
          {"undecided", record.num_undecided},
          {"workers", workers},
          {"classes", classes}};
}

}  // namespace treeroll
