#include "workers/core/learner_link.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace treeroll::worker {
namespace {

/// In a row, before one that is not for us: more than a learner sends while it counts as alive.
constexpr std::int64_t kBatchesMissedMax = std::int64_t{1} << 20U;

}  // namespace

LearnerLink::LearnerLink(const WorkerSettings& settings, std::int64_t last_index, TimePoint now)
    : settings_(settings), met_(now), last_index_sent_(last_index), last_index_seen_(last_index) {}

/// Of what names others no sequence is believed that is far ahead; what names us sets right what
/// was believed.
void LearnerLink::hear_batch(TimePoint now, std::int64_t sequence, bool names_us) {
  hear(now);
  if (!names_us && first_batch_ > 0 && sequence - last_batch_ > kBatchesMissedMax) return;
  if (names_us && last_batch_ - sequence > protocol::kBatchBits) {
    received_ = 0;
    last_batch_ = sequence;
  }
  if (first_batch_ == 0 || sequence < first_batch_) first_batch_ = sequence;
  const std::int64_t step = sequence - last_batch_;
  missing_ = missing_ || (step > 1 && last_batch_ > 0);
  if (step > 0) {
    received_ = step < protocol::kBatchBits ? received_ << static_cast<unsigned>(step) : 0;
    last_batch_ = sequence;
  }
  const std::int64_t age = last_batch_ - sequence;
  if (age < protocol::kBatchBits) received_ |= std::uint64_t{1} << static_cast<unsigned>(age);
}

bool LearnerLink::loses_batches() const {
  if (first_batch_ == 0) return false;
  const auto num_sent = std::min(protocol::kBatchBits, last_batch_ - first_batch_ + 1);
  return std::popcount(received_) < num_sent;
}

TimePoint LearnerLink::next_deadline() const {
  TimePoint deadline =
      heard_ + (given_up_ ? settings_.learner_silence_max : settings_.learner_gone);
  if (answer_at_) deadline = std::min(deadline, *answer_at_);
  if (repeat_at_) deadline = std::min(deadline, *repeat_at_);
  if (ask_at_) deadline = std::min(deadline, *ask_at_);
  return deadline;
}

void LearnerLink::repeat_after(TimePoint now, Duration interval) {
  repeat_interval_ = interval;
  repeat_at_ = now + interval;
}

Duration LearnerLink::first_pause() const {
  return loses_batches() ? settings_.repeat_interval_lossy : settings_.repeat_interval_min;
}

/// What is new does not put off the repetition of what was sent before.
void LearnerLink::on_sent(TimePoint now, std::int64_t last_index) {
  const bool waits_already = repeat_at_ && !all_seen();
  if (last_index > last_index_sent_) {
    waiting_since_.reset();
    answer_at_.reset();
    if (timed_index_ == 0) {
      timed_index_ = last_index;
      timed_at_ = now;
    }
  }
  last_index_sent_ = std::max(last_index_sent_, last_index);
  if (!waits_already && !all_seen()) repeat_after(now, first_pause());
}

bool LearnerLink::on_acknowledged(TimePoint now, std::int64_t seen_index, bool any_left,
                                  bool any_settled) {
  const std::int64_t seen = std::clamp(seen_index, last_index_seen_, last_index_sent_);
  if (timed_index_ > 0 && seen >= timed_index_) {
    round_trip_ = now - timed_at_;
    timed_index_ = 0;
  }
  const bool any_seen = std::exchange(last_index_seen_, seen) < seen;
  const bool is_news = any_seen || any_settled;
  if (!any_left) {
    repeat_at_.reset();
  } else if (is_news) {
    repeat_after(now, all_seen() ? settings_.settle_interval_min : first_pause());
  }
  return is_news;
}

std::int64_t LearnerLink::begin_repetition(TimePoint now, std::int64_t oldest) {
  timed_index_ = 0;  // which of the two is seen cannot be told
  repeat_after(now, std::min(2 * repeat_interval_, settings_.repeat_interval_max));
  return all_seen() ? oldest : std::max(oldest, last_index_seen_ + 1);
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

}  // namespace treeroll::worker
