#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <utility>

#include "common/base/time.h"
#include "common/protocol/timings.h"
#include "workers/core/worker_events.h"
#include "workers/core/worker_settings.h"

namespace treeroll::worker {

/// The link to one learner: when it was heard, when answers are sent it again and when it is asked
/// for definitions. What is sent is its owner's business.
class LearnerLink {
 public:
  /// The settings must outlive the link.
  /// @param last_index  of the last answer there is for it: all up to there count as seen
  LearnerLink(const WorkerSettings& settings, std::int64_t last_index, TimePoint now);

  void hear(TimePoint now) {
    heard_ = now;
    given_up_ = false;
  }
  /// @param names_us  else others may have said it in the learner's name, where its key is shared
  void hear_batch(TimePoint now, std::int64_t sequence, bool names_us);
  /// Its status: so many workers have joined it.
  void hear_status(TimePoint now, int num_workers) {
    hear(now);
    num_workers_ = num_workers;
  }
  /// As it said last; before, for as long as its first words may be on their way, 0. Nothing of one
  /// that says none (treeroll-doctor, say) or that is given up.
  std::optional<int> num_workers(TimePoint now) const {
    if (given_up_ || num_workers_) return given_up_ ? std::nullopt : num_workers_;
    return now < met_ + 2 * protocol::kLearnerStatusPeriod ? std::optional(0) : std::nullopt;
  }
  /// This process was stopped for so long: no silence of the learner's.
  void excuse(Duration delay) { heard_ += delay; }
  TimePoint heard() const { return heard_; }
  /// The highest sequence of its batches.
  std::int64_t last_batch() const { return last_batch_; }
  bool is_silent(TimePoint now) const { return now >= heard_ + settings_.learner_silence_max; }
  /// It is gone, and give_up() has not been called since it was heard.
  bool is_to_be_given_up(TimePoint now) const {
    return !given_up_ && now >= heard_ + settings_.learner_gone;
  }
  void give_up() { given_up_ = true; }
  bool is_given_up() const { return given_up_; }
  /// When it is gone, becomes silent, is sent answers again or asked again: whatever is first.
  TimePoint next_deadline() const;

  /// Of its batches: bit i is set if the batch last_batch() - i has come.
  std::int64_t batches_received() const { return static_cast<std::int64_t>(received_); }

  /// Whether one of the last 64 was lost: so are some of the answers, most likely.
  bool loses_batches() const;

  /// Once: whether batches have been found missing since the last word to the learner.
  bool take_missing() { return std::exchange(missing_, false); }

  /// Index of the last answer sent.
  std::int64_t last_index_sent() const { return last_index_sent_; }
  /// Index of the last answer that has been seen.
  std::int64_t last_index_seen() const { return last_index_seen_; }
  /// There is an answer that has not been sent.
  void note_new_answer(TimePoint now) {
    if (!waiting_since_) waiting_since_ = now;
  }
  /// There are answers that have not been sent: they are when the first of them has waited so long.
  /// A repetition may have taken those along since which this was known.
  void answer_after(TimePoint now, Duration wait) {
    note_new_answer(now);
    answer_at_ = *waiting_since_ + wait;
  }
  bool answer_due(TimePoint now) const { return answer_at_ && now >= *answer_at_; }
  /// From sending an answer to the word that it has been seen; nothing before the first.
  std::optional<Duration> round_trip() const { return round_trip_; }
  /// First and last of answers by their index.
  using Stretch = std::pair<std::int64_t, std::int64_t>;

  /// The question of this answer was repeated: it is due again.
  void want_again(std::int64_t index) {
    Stretch& wanted = wanted_again_ ? *wanted_again_ : wanted_again_.emplace(index, index);
    wanted = {std::min(wanted.first, index), std::max(wanted.second, index)};
  }
  /// The first and the last of these, once.
  std::optional<Stretch> take_wanted_again() { return std::exchange(wanted_again_, {}); }
  void on_sent(TimePoint now, std::int64_t last_index);
  /// The learner says what it has seen. An index that was never sent says nothing beyond the last.
  /// @param any_left      of all answers there are for it: some are not settled
  /// @param any_settled   some that were not are settled now
  /// @return  whether it was not known: some are seen or settled that were not
  bool on_acknowledged(TimePoint now, std::int64_t seen_index, bool any_left, bool any_settled);
  /// Whether answers are to be sent again now: their absence shows by the learner's silence.
  bool repetition_due(TimePoint now) const { return repeat_at_ && now >= *repeat_at_; }
  /// With each repetition. @return index of the first answer to repeat: the oldest that has not
  /// been seen, `oldest` if all have
  std::int64_t begin_repetition(TimePoint now, std::int64_t oldest);

  /// Some roll-out may wait for a definition that is not here.
  void look_for_missing() { looking_ = true; }
  bool looks_for_missing() const { return looking_; }
  /// What it was asked for has not come.
  bool asking_due(TimePoint now) const { return ask_at_ && now >= *ask_at_; }
  /// Whether to ask for these now, all that is missing: not if all were asked for just now. If so,
  /// they count as asked.
  bool ask(TimePoint now, std::set<DefinitionName> missing);

 private:
  bool all_seen() const { return last_index_seen_ >= last_index_sent_; }
  Duration first_pause() const;
  void repeat_after(TimePoint now, Duration interval);

  const WorkerSettings& settings_;
  const TimePoint met_;
  TimePoint heard_;
  bool given_up_ = false;
  std::optional<int> num_workers_;
  std::int64_t last_batch_ = 0;
  std::uint64_t received_ = 0;
  bool missing_ = false;
  std::int64_t first_batch_ = 0;  ///< the lowest of its batches that came
  std::optional<Stretch> wanted_again_;
  std::int64_t last_index_sent_ = 0;
  std::int64_t last_index_seen_ = 0;
  std::optional<TimePoint> waiting_since_;  ///< the first answer that has not been sent
  std::optional<TimePoint> answer_at_;
  std::int64_t timed_index_ = 0;  ///< of an answer that has been sent once; 0 none
  TimePoint timed_at_;
  std::optional<Duration> round_trip_;
  std::optional<TimePoint> repeat_at_;
  Duration repeat_interval_{};
  bool looking_ = false;
  std::optional<TimePoint> ask_at_;
  Duration ask_interval_{};
  std::set<DefinitionName> asked_;  ///< missing ones asked for less than ask_interval_ ago
};

}  // namespace treeroll::worker
