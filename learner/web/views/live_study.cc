#include "learner/web/views/live_study.h"

#include <algorithm>
#include <utility>

namespace treeroll::web {
namespace {

/// Points of a condition's curves: enough for a screen, fewer where many conditions or very many
/// runs share the page.
constexpr int kPointsMax = 600;
constexpr int kPointsMin = 20;
constexpr int kPointsOfStudyMax = 12'000;
constexpr int kCellsMax = 4'000'000;

constexpr std::size_t kRatesMax = 600;

int points_max(const Study& study) {
  const int num_conditions = static_cast<int>(study.conditions.size());
  return std::clamp(std::min(kPointsOfStudyMax / num_conditions, kCellsMax / study.num_runs()),
                    kPointsMin, kPointsMax);
}

/// Where a running mean over seconds goes to.
double blended(double before, double now) { return before + 0.3 * (now - before); }

}  // namespace

LiveStudy::LiveStudy(const learner::LearnerCore& core, StudyFacts facts)
    : core_(core), facts_(std::move(facts)) {
  const Study& study = core.study();
  for (const Condition& condition : study.conditions) {
    curves_.emplace_back(study.repetitions, condition.exploration.num_rollouts, points_max(study));
  }
}

void LiveStudy::applied(const learner::Run& run, int number) {
  ++version_;
  curves_[static_cast<std::size_t>(run.condition())].add(
      run.repetition(), number, run.rollouts()[static_cast<std::size_t>(number)].reward,
      run.exploration().best().reward);
  recent_.push_back({run.index(), number});
  if (recent_.size() > kRecentMax) recent_.pop_front();
}

/// Null for one too many. Each start of a worker's process is a name of its own.
SeenWorker* LiveStudy::worker(protocol::WorkerId id) {
  const auto found = workers_.find(id);
  if (found != workers_.end()) return &found->second;
  const auto& present = core_.workforce().workers().all();
  const auto entry = present.find(id);
  // There may be thousands of made-up ones each second.
  const bool is_stranger = entry != present.end() && !entry->second.has_answered_a_greeting();
  if (workers_.size() >= kWorkersMax && !is_stranger) make_room();
  return workers_.size() < kWorkersMax ? &workers_[id] : nullptr;
}

/// Of those that are gone who has answered nothing goes; else the half that has answered least, so
/// that not every newcomer costs a walk over all.
void LiveStudy::make_room() {
  const auto& present = core_.workforce().workers().all();
  std::vector<std::pair<std::int64_t, protocol::WorkerId>> gone;
  for (const auto& [id, seen] : workers_) {
    if (!present.contains(id)) gone.emplace_back(seen.num_accepted, id);
  }
  std::ranges::sort(gone);
  const auto answered = std::ranges::find_if(gone, [](const auto& one) { return one.first > 0; });
  const auto half = gone.begin() + (std::ssize(gone) + 1) / 2;
  const auto end = answered != gone.begin() ? answered : half;
  std::for_each(gone.begin(), end, [this](const auto& one) { workers_.erase(one.second); });
}

void LiveStudy::accepted(const AcceptedResult& result) {
  ++version_;
  SeenWorker* from = worker(result.worker_id);
  if (from) ++from->num_accepted;
  if (result.outcome.is_ok()) return;
  failures_.push_back({++num_failures_, result});
  if (failures_.size() > kFailuresMax) failures_.pop_front();
  std::string words(name(result.outcome.status()));
  if (!result.outcome.reason().empty()) words += ": " + std::string(result.outcome.reason());
  if (from) {
    ++from->num_failed;
    from->last_failure = words;
  }
  const bool has_room = reasons_.contains(words) || reasons_.size() < kReasonsMax;
  ++reasons_[has_room ? words : ""];
}

void LiveStudy::accepted(const KnownWorker& known) {
  if (SeenWorker* seen = worker(known.worker_id)) {
    seen->host = known.host;
    seen->pid = known.pid;
  }
}

void LiveStudy::heard(const protocol::WorkerStatus& status, protocol::LearnerId learner) {
  // Only of those that the core knows: it has bounds of its own for made-up ones.
  if (!core_.workforce().workers().all().contains(status.worker_id)) return;
  SeenWorker* seen = worker(status.worker_id);
  if (!seen) return;
  seen->host = status.host;
  seen->pid = status.pid;
  seen->num_held = 0;
  for (const protocol::HeldRollouts& held : status.held) {
    if (held.learner_id == learner) seen->num_held += static_cast<std::int64_t>(held.keys.size());
  }
  seen->status = status;
  seen->status->held.clear();
}

void LiveStudy::note(const protocol::LearnerStatus& status, TimePoint now) {
  ++version_;
  const std::int64_t done = status.num_applied + status.num_evaluated;
  pace_.note(now, done, status.num_evaluators);
  status_ = status;
  if (marked_at_ && now > *marked_at_) {
    const double seconds = to_seconds(now - *marked_at_);
    rates_.push_back(static_cast<double>(done - done_at_mark_) / seconds);
    if (rates_.size() > kRatesMax) rates_.pop_front();
    for (auto& [id, seen] : workers_) {
      const auto rate = static_cast<double>(seen.num_accepted - seen.num_at_mark) / seconds;
      seen.rate_per_s = blended(seen.rate_per_s, rate);
    }
  }
  for (auto& [id, seen] : workers_) seen.num_at_mark = seen.num_accepted;
  marked_at_ = now;
  done_at_mark_ = done;
}

}  // namespace treeroll::web
