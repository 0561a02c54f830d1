#include "workers/core/learner_link.h"

#include <algorithm>
#include <utility>

namespace treeroll::worker {
namespace {

/// At 30 % loss each way so many fail in a row less than once in two hundred times.
constexpr int kHastyRepeatsMax = 8;

}  // namespace

LearnerLink::LearnerLink(const WorkerSettings& settings, std::int64_t last_index)
    : settings_(settings), last_index_sent_(last_index) {}

void LearnerLink::hear_batch(TimePoint now, std::int64_t sequence) {
  hear(now);
  last_batch_ = std::max(last_batch_, sequence);
}

TimePoint LearnerLink::next_deadline() const {
  TimePoint deadline =
      heard_ + (given_up_ ? settings_.learner_silence_max : settings_.learner_gone);
  if (repeat_at_) deadline = std::min(deadline, *repeat_at_);
  if (ask_at_) deadline = std::min(deadline, *ask_at_);
  return deadline;
}

void LearnerLink::on_sent(TimePoint now, std::optional<std::int64_t> last_index) {
  answers_wanted_ = false;
  repeat_at_.reset();
  if (!last_index) return;
  last_index_sent_ = std::max(last_index_sent_, *last_index);
  repeat_interval_ = std::max(repeat_interval_, settings_.repeat_interval_min);
  repeat_at_ = now + repeat_interval_;
}

void LearnerLink::on_acknowledged(TimePoint now, bool any_left) {
  repeat_interval_ = settings_.repeat_interval_min;
  num_hasty_ = 0;
  repeat_at_.reset();
  if (any_left) repeat_at_ = now + repeat_interval_;
}

void LearnerLink::back_off(std::int64_t last_index) {
  if (in_haste(last_index)) {
    ++num_hasty_;
    repeat_interval_ = settings_.repeat_interval_min;
  } else {
    repeat_interval_ = std::min(2 * repeat_interval_, settings_.repeat_interval_max);
  }
}

void LearnerLink::hurry_if_full(TimePoint now, std::int64_t last_index) {
  if (!repeat_at_ || !in_haste(last_index)) return;
  repeat_at_ = std::min(*repeat_at_, now + settings_.repeat_interval_min);
}

bool LearnerLink::ask(TimePoint now, std::set<DefinitionName> missing) {
  looking_ = false;
  if (missing.empty()) {
    ask_at_.reset();
    asked_.clear();
    return false;
  }
  const bool due = !ask_at_ || now >= *ask_at_;
  if (!due && std::includes(asked_.begin(), asked_.end(), missing.begin(), missing.end())) {
    return false;
  }
  const bool is_same = due && ask_at_ && asked_ == missing;
  ask_interval_ = is_same ? std::min(2 * ask_interval_, settings_.ask_interval_max)
                          : settings_.ask_interval_min;
  asked_ = std::move(missing);
  ask_at_ = now + ask_interval_;
  return true;
}

/// Answers that find no room in a batch wait for an acknowledgement, so it is asked for some times
/// without backing off; not for ever, since a learner may have died or stall.
bool LearnerLink::in_haste(std::int64_t last_index) const {
  return num_hasty_ < kHastyRepeatsMax && last_index_sent_ < last_index;
}

}  // namespace treeroll::worker
