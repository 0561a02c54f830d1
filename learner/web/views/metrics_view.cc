// For Prometheus: https://prometheus.io/docs/instrumenting/exposition_formats
#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "learner/web/views/views.h"

namespace treeroll::web {
namespace {

/// More of them are summed up in the totals alone: each is a time series for ever.
constexpr std::size_t kLabelledMax = 500;

std::string escaped(const std::string& value) {
  std::string text;
  for (const char letter : value) {
    if (letter == '\n') {
      text += "\\n";
      continue;
    }
    if (letter == '\\' || letter == '"') text += '\\';
    text += letter;
  }
  return text;
}

class MetricsText {
 public:
  explicit MetricsText(const std::string& study) : study_(escaped(study)) {}

  void begin(const char* name, const char* type, const char* help) {
    name_ = name;
    fmt::format_to(std::back_inserter(text_), "# HELP treeroll_{0} {1}\n# TYPE treeroll_{0} {2}\n",
                   name, help, type);
  }
  /// @param labels  beside the study's: `,condition="tree"`
  void add(double value, const std::string& labels = "") {
    fmt::format_to(std::back_inserter(text_), "treeroll_{}{{study=\"{}\"{}}} {}\n", name_, study_,
                   labels, value);
  }
  void one(const char* name, const char* type, const char* help, double value) {
    begin(name, type, help);
    add(value);
  }
  std::string take() { return std::move(text_); }

 private:
  std::string study_;
  const char* name_ = "";
  std::string text_;
};

std::string condition_label(const Condition& condition) {
  return fmt::format(",condition=\"{}\"", escaped(condition.name));
}

void add_ledger(const LedgerCounters& counters, MetricsText& text) {
  const auto counter = [&](const char* name, const char* help, std::int64_t value) {
    text.one(name, "counter", help, static_cast<double>(value));
  };
  counter("rollouts_issued_total", "Distinct roll-outs drawn.", counters.issued);
  counter("rollouts_applied_total", "Roll-outs that have been learnt from.", counters.applied);
  counter("rollouts_failed_total", "Applied roll-outs whose status is not ok.", counters.failed);
  counter("trials_discarded_total", "Trials that were void and made again.", counters.discarded);
  counter("rollouts_reissued_total", "Leases given out again.", counters.reissued);
  counter("answers_late_total", "Answers accepted after their lease.", counters.late);
  counter("answers_duplicate_total", "Answers to what had one.", counters.duplicate);
  counter("answers_rejected_total", "Answers refused.", counters.rejected);
  counter("answers_unasked_total", "Refused of those who were not asked.", counters.unasked);
  counter("answers_conflicting_total", "Duplicates with another reward.", counters.conflicting);
  text.one("rollouts_pending", "gauge", "Roll-outs drawn and not applied.",
           static_cast<double>(counters.pending));
}

void add_rechecks(const RecheckRecord& record, MetricsText& text) {
  const auto counter = [&](const char* name, const char* help, std::int64_t value) {
    text.one(name, "counter", help, static_cast<double>(value));
  };
  counter("rollouts_rechecked_total", "Run again on another worker.", record.num_rechecked);
  counter("rollouts_disputed_total", "Run again, and two answers differ.", record.num_disputed);
  const auto each = [&](const char* name, const char* help, auto count) {
    text.begin(name, "counter", help);
    std::size_t num_shown = 0;
    for (const auto& [id, tally] : record.workers) {
      if (++num_shown > kLabelledMax) break;
      text.add(static_cast<double>(tally.*count),
               fmt::format(",worker=\"{}\",host=\"{}\"", id, escaped(tally.worker.host)));
    }
  };
  each("worker_answers_compared_total", "Answers of a worker compared with another's.",
       &RecheckedWorker::num_compared);
  each("worker_answers_differing_total", "Of these, those that differ.",
       &RecheckedWorker::num_disagreed);
  each("worker_outvoted_total", "Roll-outs in which two others contradict a worker.",
       &RecheckedWorker::num_outvoted);
}

void add_conditions(const LiveStudy& study, MetricsText& text) {
  const Study& what = study.core().study();
  std::vector<double> best(what.conditions.size());
  std::vector<double> applied(what.conditions.size());
  for (const learner::Run& run : study.core().runs()) {
    const auto place = static_cast<std::size_t>(run.condition());
    const explore::Exploration& exploration = run.exploration();
    if (exploration.best().rollout >= 0) {
      best[place] = std::max(best[place], exploration.best().reward);
    }
    applied[place] += exploration.num_told();
  }
  const std::size_t num_shown = std::min(best.size(), kLabelledMax);
  text.begin("condition_best_reward", "gauge", "Best reward of all runs of a condition.");
  for (std::size_t i = 0; i < num_shown; ++i)
    text.add(best[i], condition_label(what.conditions[i]));
  text.begin("condition_rollouts_applied_total", "counter", "Applied roll-outs of a condition.");
  for (std::size_t i = 0; i < num_shown; ++i) {
    text.add(applied[i], condition_label(what.conditions[i]));
  }
}

void add_workers(const LiveStudy& study, TimePoint now, MetricsText& text) {
  const auto& present = study.core().workforce().workers().all();
  const auto each = [&](const char* name, const char* type, const char* help, const auto& value) {
    text.begin(name, type, help);
    std::size_t num_shown = 0;
    for (const auto& [id, worker] : present) {
      if (++num_shown > kLabelledMax) break;
      text.add(value(id, worker),
               fmt::format(",worker=\"{}\",host=\"{}\"", id, escaped(worker.host)));
    }
  };
  each("worker_results_accepted_total", "counter", "Results accepted of a worker.",
       [](auto, const auto& worker) { return static_cast<double>(worker.num_accepted); });
  each("worker_rollouts_in_flight", "gauge", "Roll-outs leased to a worker.",
       [&](auto id, const auto&) {
         return static_cast<double>(study.core().ledger().leases_of(id).size());
       });
  each("worker_evaluators", "gauge", "Evaluators of a worker.",
       [](auto, const auto& worker) { return static_cast<double>(worker.num_evaluators); });
  each("worker_silent_seconds", "gauge", "Since a worker was heard last.",
       [&](auto, const auto& worker) { return to_seconds(now - worker.last_heard); });
}

}  // namespace

std::string metrics_view(const LiveStudy& study, TimePoint now) {
  const learner::LearnerCore& core = study.core();
  const protocol::LearnerStatus status = study.status().value_or(protocol::LearnerStatus{});
  MetricsText text(core.study().name);
  add_ledger(core.counters(), text);
  if (core.study().recheck > 0) add_rechecks(core.workforce().rechecks().record(), text);
  text.one("rollouts_budget", "gauge", "Roll-outs of the whole study.",
           static_cast<double>(status.num_rollouts));
  text.one("runs", "gauge", "Runs of the study.", status.num_runs);
  text.one("runs_done", "gauge", "Runs that have ended.", status.num_runs_done);
  text.one("workers", "gauge", "Workers that answer this learner.", status.num_workers);
  text.one("evaluators", "gauge", "Their evaluators.", status.num_evaluators);
  text.one("best_reward", "gauge", "Best reward of all runs.", status.best_reward);
  text.one("rollouts_per_second", "gauge", "Running mean; 0 while unknown.",
           study.rollouts_per_s().value_or(0));
  text.one("results_unsynced", "gauge", "Accepted, and perhaps not on stable storage.",
           static_cast<double>(core.workforce().num_unsynced()));
  text.one("waiting", "gauge", "1 while nothing moves.", status.waiting_for.empty() ? 0 : 1);
  text.one("elapsed_seconds", "gauge", "Since this learner's start.", status.elapsed_s);
  add_conditions(study, text);
  add_workers(study, now, text);
  return text.take();
}

}  // namespace treeroll::web
