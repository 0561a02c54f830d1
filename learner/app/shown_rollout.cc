#include "learner/app/shown_rollout.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/files/atomic_file.h"
#include "common/program/standard_output.h"
#include "learner/app/replayed_policy.h"
#include "learner/core/run.h"
#include "learner/report/figures/shown_trace.h"
#include "learner/web/views/policy_view.h"
#include "learner/web/views/view_text.h"
#include "learner/worker_program/task_survey.h"
#include "learner/worker_program/worker_evaluation.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr const char* kOption = "--show";
/// A screen shows no more of a trace.
constexpr std::size_t kRowsMax = 500;

/// A roll-out as it was drawn, and what came of it.
struct FoundRollout {
  explore::Draw draw = {};
  PolicyPtr layer_policy = {};  ///< that theta is of
  std::int64_t seed = 0;        ///< of its task, in the trial that counted
  std::optional<explore::SearchDistribution> from = {};
  std::optional<Outcome> outcome = {};
};

/// Folds one run alone: runs do not know of each other.
class RunReader {
 public:
  RunReader(const Study& study, protocol::RolloutKey key)
      : study_(study), key_(key), run_(study, key.run) {
    draw();
  }

  void read(const NumberedRecord& numbered) {
    if (const auto* time = std::get_if<LearningTime>(&numbered.record)) return pass(*time);
    const auto* result = std::get_if<AcceptedResult>(&numbered.record);
    if (!result || result->key.run != key_.run) return;
    const int number = result->key.number;
    if (!open_.contains(number)) {
      // An evaluation of a study that has been extended since counts only if it is asked for.
      if (numbered.is_of_earlier_study && number < 0) return;
      throw std::runtime_error(fmt::format(
          "it answers run {} roll-out {}, which is not asked for at this place", key_.run, number));
    }
    if (number == key_.number && found_) {
      found_->outcome = result->outcome;
      found_->seed =
          learner::task_seed(study_, run_.repetition(), number, run_.num_discards(number));
    }
    open_.erase(number);
    run_.accept(number, result->outcome, 0);
    draw();
  }

  std::optional<FoundRollout> take() { return std::move(found_); }
  int num_told() const { return run_.exploration().num_told(); }

 private:
  void draw() {
    for (explore::Draw& draw : run_.take_draws()) {
      open_.insert(draw.rollout);
      if (draw.rollout == key_.number) note(std::move(draw));
    }
  }

  void note(explore::Draw draw) {
    FoundRollout found{.draw = std::move(draw)};
    // Roll-outs of earlier layers refer to the policy as it was when their layer began.
    found.layer_policy = run_.exploration().policy(found.draw.layer).at_layer(found.draw.layer);
    found.seed =
        learner::task_seed(study_, run_.repetition(), key_.number, run_.num_discards(key_.number));
    if (const explore::SearchDistribution* from = run_.exploration().drawn_from(key_.number)) {
      found.from = *from;
    }
    found_ = std::move(found);
  }

  void pass(const LearningTime& time) {
    if (!study_.stop_after || time.elapsed < *study_.stop_after || run_.done()) return;
    run_.stop();
    draw();
  }

  const Study& study_;
  protocol::RolloutKey key_;
  learner::Run run_;
  std::set<int> open_;
  std::optional<FoundRollout> found_;
};

json trace_view(const RolloutTrace& whole) {
  const RolloutTrace trace = report::thinned(whole, kRowsMax);
  json view{{"columns", trace.columns},
            {"titles", json::array()},
            {"data", json::array()},
            {"policy_inputs", trace.policy_inputs},
            {"policy_outputs", trace.policy_outputs},
            {"poses", trace.poses}};
  for (const std::string& column : trace.columns) {
    view["titles"].push_back(report::axis_title(column));
    view["data"].push_back(*report::column_of(trace, column));
  }
  return view;
}

constexpr const char* kNotRepeatable =
    "its task says repeatable = false (a robot, say), and is not run only to be shown";

/// What a worker executable says when it makes the roll-out once more. A failure to do so begins as
/// web::kNotSimulated does.
/// @param wrong_option  receives what is wrong with the option that names the user's program
json made_again(const Condition& condition, const std::string& policy, std::int64_t seed,
                const WorkerProgram& worker_program, std::optional<ConfigError>& wrong_option) {
  try {
    const std::optional<TaskDescription> task =
        describe_repeatable(condition.task_content, worker_program);
    if (!task) return {{"failure", kNotRepeatable}};
    const PolicyEvaluation done = evaluate_with(worker_program, *task,
                                                {.task_content = condition.task_content,
                                                 .policy_text = policy,
                                                 .seed = seed,
                                                 .trace = true});
    return {{"reward", done.outcome.reward()},
            {"status", name(done.outcome.status())},
            {"reason", done.outcome.reason()},
            {"terms", done.terms},
            {"trace", done.trace.columns.empty() ? json(nullptr) : trace_view(done.trace)}};
  } catch (const ConfigError& error) {
    if (error.key() == kEvaluatorOption) wrong_option = error;
    return {{"failure", error.what()}};
  } catch (const std::runtime_error& error) {
    return {{"failure", error.what()}};
  }
}

json view_of(const FoundRollout& found, const Study& study, protocol::RolloutKey key,
             const WorkerProgram& worker_program, std::optional<ConfigError>& wrong_option) {
  const Condition& condition =
      study.conditions[static_cast<std::size_t>(key.run / study.repetitions)];
  json view{{"run", key.run},
            {"rollout", key.number},
            {"condition", condition.name},
            {"condition_index", key.run / study.repetitions},
            {"repetition", key.run % study.repetitions},
            {"layer", found.draw.layer},
            {"reward", nullptr},
            {"status", nullptr},
            {"reason", ""},
            {"policy", nullptr},
            {"mean", nullptr},
            {"noise", nullptr},
            {"again", nullptr}};
  if (found.outcome) {
    view["reward"] = found.outcome->reward();
    view["status"] = name(found.outcome->status());
    view["reason"] = found.outcome->reason();
  }
  const Policy& layer = *found.layer_policy;
  if (found.from) {
    view["noise"] = web::noise_view(layer, found.from->mean, found.from->noise);
    try {
      view["mean"] = web::policy_view(*layer.with(found.from->mean));
    } catch (const std::invalid_argument&) {
      view["mean"] = nullptr;
    }
  }
  try {
    const PolicyPtr policy = layer.with(found.draw.theta);
    view["policy"] = web::policy_view(*policy);
    view["again"] =
        made_again(condition, to_json(*policy), found.seed, worker_program, wrong_option);
  } catch (const std::invalid_argument& error) {
    view["again"] = {{"failure", fmt::format("its theta makes no policy: {}", error.what())}};
  }
  return view;
}

}  // namespace

void show_rollout(const StateFiles& files, const std::string& rollout,
                  const WorkerProgram& worker_program, const std::filesystem::path& output_file) {
  const StateStudy state = read_state_study(files);
  const Study& study = state.loaded.study;
  const protocol::RolloutKey key = read_rollout_key(kOption, rollout, study.num_runs());
  RunReader reader(study, key);
  read_numbered(files.journal, state.in_journal, study.repetitions,
                [&](const NumberedRecord& record) { reader.read(record); });
  const std::optional<FoundRollout> found = reader.take();
  if (!found) {
    throw ConfigError(kOption, rollout,
                      fmt::format("must be a roll-out of the journal: run {} has {} results so far",
                                  key.run, reader.num_told()));
  }
  std::optional<ConfigError> wrong_option;
  const std::string text =
      web::dumped(view_of(*found, study, key, worker_program, wrong_option)) + "\n";
  if (output_file.empty()) {
    fmt::print("{}", text);
    flush_standard_output();
  } else {
    write_atomically(output_file, text);
  }
  // All but the roll-out made again is there for whoever reads it, a page say.
  if (wrong_option) throw ConfigError(*wrong_option);
}

}  // namespace treeroll
