#include "learner/app/export_rollouts.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "common/base/csv_field.h"
#include "common/files/atomic_file.h"

namespace treeroll {
namespace {

using nlohmann::ordered_json;

/// A text in a row is quoted where it needs to be, a list has ";" between its numbers.
std::string as_csv(const ordered_json& value) {
  if (value.is_null()) return "";
  if (value.is_string()) return csv_field(value.get<std::string>());
  if (value.is_number_float()) return fmt::format("{}", value.get<double>());
  if (!value.is_array()) return value.dump();
  std::string text;
  for (const ordered_json& element : value) {
    fmt::format_to(std::back_inserter(text), "{}{}", text.empty() ? "" : ";",
                   element.get<double>());
  }
  return text;
}

ordered_json list_of(const Eigen::VectorXd& numbers) {
  return std::vector<double>(numbers.data(), numbers.data() + numbers.size());
}

/// Follows a fold, and makes a row of each result.
class RolloutTable {
 public:
  RolloutTable(bool as_json, const std::filesystem::path& output_file) : as_json_(as_json) {
    if (!output_file.empty()) file_.emplace(output_file);
  }

  void before(const learner::LearnerCore& core, const JournalRecord& record) {
    if (const auto* start = std::get_if<JournalStart>(&record)) learner_ = start->learner_id;
    if (const auto* worker = std::get_if<KnownWorker>(&record))
      workers_[worker->worker_id] = *worker;
    const auto* result = std::get_if<AcceptedResult>(&record);
    if (!result) return;
    const learner::Ledger::Entry* open = core.ledger().find(result->key);
    if (open) open_[result->key] = row_of(core, *result, open->question.theta);
  }

  void applied(const learner::Run& run, int number) {
    const auto found = open_.find({run.index(), number});
    if (found == open_.end()) return;
    const explore::Exploration& exploration = run.exploration();
    // After a switch the window is the next layer's.
    const bool is_of_layer = found->second.at("layer") == exploration.layer();
    if (const auto slope = exploration.reward_slope(); slope && is_of_layer) {
      found->second["reward_slope"] = *slope;
    }
    write(found->second);
    open_.erase(found);
  }

  void after(const learner::LearnerCore& core, const JournalRecord& record) {
    const auto* result = std::get_if<AcceptedResult>(&record);
    if (!result) return;
    // A void trial is made again under its number: it has a row of its own.
    const bool is_open = core.is_unanswered(result->key);
    const bool is_void = result->outcome.is_discarded() && is_open;
    if (result->key.number >= 0 && !is_void) return;
    const auto found = open_.find(result->key);
    if (found == open_.end()) return;
    // One that an extension has superseded has left the question open.
    if (is_void || !is_open) write(found->second);
    open_.erase(found);
  }

  /// What waits for results of lower numbers; then the file is there.
  void finish() {
    for (const auto& [key, row] : open_) write(row);
    if (is_empty_) write_header(empty_row());
    if (file_) file_->commit();
  }

 private:
  static ordered_json empty_row() {
    ordered_json row;
    for (const char* column : {"condition", "repetition", "run", "rollout", "layer", "reward",
                               "status", "reason", "duration_s", "worker", "host", "pid", "learner",
                               "reward_slope", "theta", "mean", "noise_deviations"}) {
      row[column] = nullptr;
    }
    return row;
  }

  ordered_json row_of(const learner::LearnerCore& core, const AcceptedResult& result,
                      const Eigen::VectorXd& theta) const {
    const learner::Run& run = core.runs()[static_cast<std::size_t>(result.key.run)];
    const explore::Exploration& exploration = run.exploration();
    ordered_json row = empty_row();
    row["condition"] = core.study().conditions[static_cast<std::size_t>(run.condition())].name;
    row["repetition"] = run.repetition();
    row["run"] = run.index();
    row["rollout"] = result.key.number;
    row["layer"] = run.layer_of(result.key.number);
    row["reward"] = result.outcome.reward();
    row["status"] = name(result.outcome.status());
    row["reason"] = result.outcome.reason();
    if (result.duration_ns) row["duration_s"] = static_cast<double>(*result.duration_ns) / 1e9;
    // As text: of 63 bits most readers of JSON keep 53.
    row["worker"] = std::to_string(result.worker_id);
    row["learner"] = std::to_string(learner_);
    if (const auto worker = workers_.find(result.worker_id); worker != workers_.end()) {
      row["host"] = worker->second.host;
      row["pid"] = worker->second.pid;
    }
    row["theta"] = list_of(theta);
    if (const explore::SearchDistribution* from = exploration.drawn_from(result.key.number)) {
      row["mean"] = list_of(from->mean);
      row["noise_deviations"] = list_of(from->noise.diagonal().cwiseSqrt());
    }
    return row;
  }

  void write_header(const ordered_json& row) {
    is_empty_ = false;
    if (as_json_) return;
    std::string line;
    for (const auto& [column, value] : row.items()) line += (line.empty() ? "" : ",") + column;
    put(line + "\n");
  }

  void write(const ordered_json& row) {
    if (is_empty_) write_header(row);
    if (as_json_)
      return put(row.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + "\n");
    std::string line;
    bool is_first = true;
    for (const auto& [column, value] : row.items()) {
      if (!std::exchange(is_first, false)) line += ',';
      line += as_csv(value);
    }
    put(line + "\n");
  }

  void put(const std::string& text) {
    if (file_) return file_->append(text);
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) {
      throw std::system_error(errno, std::generic_category(), "cannot write to standard output");
    }
  }

  bool as_json_;
  std::optional<AtomicFile> file_;
  bool is_empty_ = true;
  protocol::LearnerId learner_ = 0;
  std::map<protocol::WorkerId, KnownWorker> workers_;
  std::map<protocol::RolloutKey, ordered_json> open_;  // accepted, not applied yet
};

}  // namespace

void export_rollouts(const StateFiles& files, bool as_json,
                     const std::filesystem::path& output_file) {
  const StateStudy state = read_state_study(files);
  RolloutTable table(as_json, output_file);
  learner::LearnerSettings settings;
  settings.on_applied = [&](const learner::Run& run, int number) { table.applied(run, number); };
  learner::LearnerCore core(state.loaded.study, settings);
  fold_state(files, state, TimePoint{}, core,
             {.before = [&](const JournalRecord& record) { table.before(core, record); },
              .after = [&](const JournalRecord& record) { table.after(core, record); }});
  table.finish();
}

}  // namespace treeroll
