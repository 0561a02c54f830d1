#include "learner/top/group_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/shown_reward.h"

namespace treeroll::top {
namespace {

/// Learners speak once a second, workers four times: who has been silent so long has gone, and is
/// forgotten after the longer time.
constexpr Duration kSilent = std::chrono::seconds(4);
constexpr Duration kForgotten = std::chrono::minutes(10);
constexpr std::size_t kBarWidth = 24;

/// What others wrote moves no cursor and rings no bell.
std::string visible(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char byte) { return byte < 0x20 || byte > 0x7e; }, '?');
  return text;
}

std::string bar(double share, std::size_t width) {
  const double part = std::isfinite(share) ? std::clamp(share, 0., 1.) : 0;
  const auto full = static_cast<std::size_t>(part * static_cast<double>(width));
  return "[" + std::string(full, '#') + std::string(width - full, '.') + "]";
}

double share_of(double part, double whole) { return whole > 0 ? part / whole : 0; }

std::string as_seconds(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

/// Room for whoever is new: the one heard longest ago leaves.
template <class Seen>
void make_room(Seen& seen, std::size_t count_max) {
  if (seen.size() < count_max) return;
  seen.erase(std::min_element(seen.begin(), seen.end(), [](const auto& a, const auto& b) {
    return a.second.heard < b.second.heard;
  }));
}

void cut(Line& line, std::size_t width) {
  for (Span& span : line) {
    if (span.text.size() > width) span.text.resize(width);
    width -= span.text.size();
  }
}

void fit(std::vector<Line>& lines, std::size_t width, std::size_t height) {
  if (lines.size() > height) lines.resize(height);
  for (Line& line : lines) cut(line, width);
}

}  // namespace

void GroupView::hear(const protocol::Message& message, TimePoint now) {
  if (const auto* status = std::get_if<protocol::LearnerStatus>(&message)) {
    if (!learners_.contains(status->learner_id)) make_room(learners_, kLearnersMax);
    SeenLearner& learner = learners_[status->learner_id];
    learner.status = *status;
    learner.heard = now;
    learner.pace.note(now, status->num_applied + status->num_evaluated, status->num_evaluators);
  } else if (const auto* run = std::get_if<protocol::RunStatus>(&message)) {
    // Of learners that have not spoken nothing is known to put it under.
    const auto learner = learners_.find(run->learner_id);
    if (learner == learners_.end()) return;
    auto& runs = learner->second.runs;
    if (runs.size() < kRunsMax || runs.contains(run->run)) runs[run->run] = *run;
  } else if (const auto* worker = std::get_if<protocol::WorkerStatus>(&message)) {
    if (!workers_.contains(worker->worker_id)) make_room(workers_, kWorkersMax);
    SeenWorker& seen = workers_[worker->worker_id];
    seen.status = *worker;
    seen.num_held = 0;
    for (const protocol::HeldRollouts& held : worker->held) seen.num_held += held.keys.size();
    seen.status.held.clear();
    seen.heard = now;
  }
}

void GroupView::forget_silent(TimePoint now) {
  const auto is_gone = [now](const auto& each) { return now - each.second.heard > kForgotten; };
  std::erase_if(learners_, is_gone);
  std::erase_if(workers_, is_gone);
}

std::vector<GroupView::Learners::const_iterator> GroupView::in_order(TimePoint now) const {
  std::vector<Learners::const_iterator> order;
  for (auto learner = learners_.begin(); learner != learners_.end(); ++learner) {
    order.push_back(learner);
  }
  std::stable_partition(order.begin(), order.end(),
                        [now](const auto& each) { return now - each->second.heard <= kSilent; });
  return order;
}

std::size_t GroupView::place_of(const Choice& choice,
                                const std::vector<Learners::const_iterator>& order) const {
  const auto chosen = std::find_if(order.begin(), order.end(), [&choice](const auto& each) {
    return each->first == choice.learner;
  });
  return chosen == order.end() ? 0 : static_cast<std::size_t>(chosen - order.begin());
}

std::size_t GroupView::num_runs(const Choice& choice, TimePoint now) const {
  if (learners_.empty()) return 0;
  const auto order = in_order(now);
  return order[place_of(choice, order)]->second.runs.size();
}

std::optional<protocol::LearnerId> GroupView::next_learner(const Choice& choice,
                                                           TimePoint now) const {
  if (learners_.empty()) return std::nullopt;
  const auto order = in_order(now);
  return order[(place_of(choice, order) + 1) % order.size()]->first;
}

void GroupView::add_learner(const SeenLearner& learner, TimePoint now,
                            std::vector<Line>& lines) const {
  const protocol::LearnerStatus& status = learner.status;
  const std::int64_t done = status.num_applied + status.num_evaluated;
  const std::int64_t all = status.num_rollouts + status.num_evaluations;
  const double share = share_of(static_cast<double>(done), static_cast<double>(all));
  lines.push_back({{fmt::format("{} ", visible(status.study)), Look::kHead},
                   {fmt::format("learner on {} pid {}  ", visible(status.host), status.pid)},
                   {bar(share, kBarWidth), Look::kBar},
                   {fmt::format(" {:.0f} %", 100 * share), Look::kHead}});
  std::string pace = "-";
  std::string left = "-";
  if (const auto per_s = learner.pace.per_s(); per_s && *per_s > 0) {
    pace = fmt::format("{:.3g}/s", *per_s);
    left = as_seconds(static_cast<double>(all - done) / *per_s);
  }
  lines.push_back(
      {{fmt::format("roll-outs {} of {}  runs {} of {}  best {}  pace {}  left {}  for {}", done,
                    all, status.num_runs_done, status.num_runs,
                    status.best_reward > 0 ? shown_reward(status.best_reward) : "-", pace, left,
                    as_seconds(status.elapsed_s))}});
  lines.push_back(
      {{fmt::format("pending {}  again {}  late {}  twice {}  refused {}  ", status.num_pending,
                    status.num_reissued, status.num_late, status.num_duplicate,
                    status.num_rejected)},
       {fmt::format("failed {}", status.num_failed),
        status.num_failed > 0 ? Look::kBad : Look::kPlain},
       {fmt::format("  void {}", status.num_discarded)},
       {status.num_conflicting > 0 ? fmt::format("  in conflict {}", status.num_conflicting) : "",
        Look::kBad}});
  if (now - learner.heard > kSilent) {
    lines.push_back({{fmt::format("silent for {}: it has ended, or cannot be heard",
                                  as_seconds(to_seconds(now - learner.heard))),
                      Look::kBad}});
  } else if (!status.waiting_for.empty()) {
    lines.push_back({{"waiting: " + visible(status.waiting_for), Look::kWarning}});
  }
  if (!status.last_failure.empty()) {
    lines.push_back({{"last failure: " + visible(status.last_failure), Look::kBad}});
  }
}

void GroupView::add_workers(TimePoint now, std::size_t count_max, std::vector<Line>& lines) const {
  lines.push_back({});
  lines.push_back({{fmt::format("{:<20.20} {:>8} {:>10} {:>6} {:>10} {:>8} {:>8} {:>7}  ",
                                fmt::format("WORKERS {}", workers_.size()), "pid", "evaluators",
                                "held", "evaluated", "failed", "restarts", "heard"),
                    Look::kQuiet}});
  std::size_t count = 0;
  for (const auto& [id, worker] : workers_) {
    if (count++ == count_max) {
      lines.push_back(
          {{fmt::format("... and {} more", workers_.size() - count_max), Look::kQuiet}});
      return;
    }
    const protocol::WorkerStatus& status = worker.status;
    const bool is_silent = now - worker.heard > kSilent;
    const std::string state = is_silent ? "silent" : status.draining ? "drains" : "";
    lines.push_back(
        {{fmt::format("{:<20.20} {:>8} {:>10} {:>6} {:>10} ", visible(status.host), status.pid,
                      status.num_evaluators, worker.num_held, status.num_evaluated)},
         {fmt::format("{:>8} ", status.num_failed),
          status.num_failed > 0 ? Look::kBad : Look::kPlain},
         {fmt::format("{:>8} ", status.num_restarts),
          status.num_restarts > 0 ? Look::kWarning : Look::kPlain},
         {fmt::format("{:>5.1f} s  ", to_seconds(now - worker.heard))},
         {state, is_silent ? Look::kBad : Look::kWarning}});
  }
}

void GroupView::add_runs(const SeenLearner& learner, const Choice& choice, std::size_t height,
                         std::vector<Line>& lines) const {
  std::vector<const protocol::RunStatus*> runs;
  for (const auto& [number, run] : learner.runs) runs.push_back(&run);
  if (choice.order != RunOrder::kNumber) {
    const bool best_first = choice.order == RunOrder::kBest;
    std::stable_sort(runs.begin(), runs.end(), [best_first](const auto* a, const auto* b) {
      return best_first ? a->best_reward > b->best_reward : a->best_reward < b->best_reward;
    });
  }
  lines.push_back({});
  lines.push_back(
      {{fmt::format("{:>6} {:<24.24} {:>4} {:>5} {:<12} {:>11} {:>8} {:>8} {:>8} {:>9} {:>7}",
                    "RUN", "condition", "rep", "layer", "roll-outs", "", "best", "mean", "last",
                    "noise", "failed"),
        Look::kQuiet}});
  const std::size_t from = std::min(choice.from, runs.empty() ? 0 : runs.size() - 1);
  for (std::size_t i = from; i < runs.size() && lines.size() < height; ++i) {
    const protocol::RunStatus& run = *runs[i];
    lines.push_back(
        {{fmt::format("{:>6} {:<24.24} {:>4} {:>5} ", run.run, visible(run.condition),
                      run.repetition, run.layer)},
         {bar(share_of(run.num_applied, run.num_rollouts), 10),
          run.done ? Look::kGood : Look::kBar},
         {fmt::format(" {:>11} {:>8} {:>8} {:>8} {:>9.3g} ",
                      fmt::format("{}/{}", run.num_applied, run.num_rollouts),
                      shown_reward(run.best_reward), shown_reward(run.mean_reward),
                      shown_reward(run.last_reward), run.noise_deviation)},
         {fmt::format("{:>7}", run.num_failed), run.num_failed > 0 ? Look::kBad : Look::kPlain},
         {run.done ? "  done" : "", Look::kGood}});
  }
}

void GroupView::add_all(const std::vector<Learners::const_iterator>& learners, const Choice& choice,
                        std::size_t height, TimePoint now, std::vector<Line>& lines) const {
  if (learners.empty()) {
    lines.push_back({{"no learner is heard on this LCM URL", Look::kWarning}});
  }
  for (const auto& learner : learners) add_learner(learner->second, now, lines);
  if (!is_verified_) {
    lines.push_back(
        {{"unverified: anybody on the group may have said this (--key-file)", Look::kQuiet}});
  }
  add_workers(now, learners.empty() ? height : std::max<std::size_t>(2, height / 4), lines);
  for (const auto& learner : learners) {
    const protocol::LearnerStatus& status = learner->second.status;
    if (learners.size() > 1) {
      lines.push_back({});
      lines.push_back({{fmt::format("{} ", visible(status.study)), Look::kHead},
                       {fmt::format("on {} pid {}", visible(status.host), status.pid)}});
    }
    add_runs(learner->second, choice, height, lines);
  }
}

std::vector<Line> GroupView::lines(const Choice& choice, std::size_t width, std::size_t height,
                                   TimePoint now) const {
  std::vector<Line> lines;
  auto shown = in_order(now);
  if (shown.size() > 1) {
    const std::size_t place = place_of(choice, shown);
    lines.push_back(
        {{fmt::format("learner {} of {} (Tab: the next)", place + 1, shown.size()), Look::kQuiet}});
    shown = {shown[place]};
  }
  add_all(shown, choice, height, now, lines);
  fit(lines, width, height);
  return lines;
}

std::vector<Line> GroupView::lines_of_all(std::size_t width, std::size_t height,
                                          TimePoint now) const {
  std::vector<Line> lines;
  add_all(in_order(now), {}, height, now, lines);
  fit(lines, width, height);
  return lines;
}

std::string plain_text(const std::vector<Line>& lines) {
  std::string text;
  for (const Line& line : lines) {
    std::string words;
    for (const Span& span : line) words += span.text;
    while (words.ends_with(' ')) words.pop_back();
    text += words + "\n";
  }
  return text;
}

}  // namespace treeroll::top
