#pragma once

#include <cstdint>
#include <optional>
#include <set>

#include "common/base/time.h"
#include "workers/core/worker_events.h"
#include "workers/core/worker_settings.h"

namespace treeroll::worker {

/// The link to one learner: when it was heard, when answers are sent it again and when it is asked
/// for definitions. What is sent is its owner's business.
class LearnerLink {
 public:
  /// The settings must outlive the link.
  /// @param last_index  of the last answer there is for it: all up to there count as sent
  LearnerLink(const WorkerSettings& settings, std::int64_t last_index);

  void hear(TimePoint now) {
    heard_ = now;
    given_up_ = false;
  }
  void hear_batch(TimePoint now, std::int64_t sequence);
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
  /// When it is gone, becomes silent, is sent answers again or asked again: whatever is first.
  TimePoint next_deadline() const;

  /// A question was repeated: its answer is due even if nothing is new.
  void want_answers() { answers_wanted_ = true; }
  /// @param window_end  index of the last answer that would go along
  bool answers_due(std::int64_t window_end) const {
    return answers_wanted_ || window_end > last_index_sent_;
  }
  /// @param last_index  of the last answer sent; nothing if there was none to send
  void on_sent(TimePoint now, std::optional<std::int64_t> last_index);
  /// Some that were not are acknowledged now. @param any_left  others are not
  void on_acknowledged(TimePoint now, bool any_left);
  bool repetition_due(TimePoint now) const { return repeat_at_ && now >= *repeat_at_; }
  /// Before each repetition. @param last_index  of the last answer there is
  void back_off(std::int64_t last_index);
  /// Answers that found no room are not kept waiting. @param last_index  as for back_off()
  void hurry_if_full(TimePoint now, std::int64_t last_index);

  /// Some roll-out may wait for a definition that is not here.
  void look_for_missing() { looking_ = true; }
  bool looks_for_missing() const { return looking_; }
  /// What it was asked for has not come.
  bool asking_due(TimePoint now) const { return ask_at_ && now >= *ask_at_; }
  /// Whether to ask for these now, all that is missing: not if all were asked for just now. If so,
  /// they count as asked.
  bool ask(TimePoint now, std::set<DefinitionName> missing);

  /// Where the next batch of answers goes on naming what is held.
  protocol::RolloutKey held_from = protocol::kFirstKey;

 private:
  bool in_haste(std::int64_t last_index) const;

  const WorkerSettings& settings_;
  TimePoint heard_;
  bool given_up_ = false;
  std::int64_t last_batch_ = 0;
  bool answers_wanted_ = false;
  std::int64_t last_index_sent_ = 0;
  std::optional<TimePoint> repeat_at_;
  Duration repeat_interval_{};
  int num_hasty_ = 0;  ///< repetitions without backing off since answers were acknowledged
  bool looking_ = false;
  std::optional<TimePoint> ask_at_;
  Duration ask_interval_{};
  std::set<DefinitionName> asked_;  ///< missing ones asked for less than ask_interval_ ago
};

}  // namespace treeroll::worker
