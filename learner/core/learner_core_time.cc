// A study that is learnt for a time: how long it has been, and its end.
#include <fmt/format.h>

#include <algorithm>

#include "common/base/check.h"
#include "learner/core/learner_core.h"

namespace treeroll::learner {

/// When the time is up, if nothing happens before.
std::optional<TimePoint> LearnerCore::time_end() const {
  if (!study_.stop_after || time_is_up_ || !at_work_since_ || is_learnt()) return std::nullopt;
  return *at_work_since_ + (*study_.stop_after - learnt_before_);
}

/// Notes how long it has been, for the journal: now and then, so that a crash costs little of what
/// has been counted, and when the time is up.
void LearnerCore::read_clock(const Turn& turn) {
  if (!time_end()) return;
  LearningTime time{learnt_before_ + (turn.now - *at_work_since_)};
  // A run is stopped in its new layer, as where a journal is folded: until then time is not up.
  const Duration before_the_end = *study_.stop_after - Duration(1);
  if (!at_switch_.empty()) time.elapsed = std::min(time.elapsed, before_the_end);
  if (time == learnt_) return;
  turn.effects.emplace_back(AppendTime{time});
  pass_time(turn, time);
}

/// What live learners and those that fold a journal do alike: from the record that says that the
/// time is up on, runs draw nothing more.
void LearnerCore::pass_time(const Turn& turn, const LearningTime& time) {
  learnt_ = time;
  if (time_is_up_ || learnt_.elapsed < *study_.stop_after) return;
  time_is_up_ = true;
  for (Run& run : runs_) {
    if (run.done()) continue;
    run.stop();
    draw(turn, run);
  }
  turn.inform(
      "time",
      fmt::format("the study's time of {:g} s is up with {} roll-outs; what is under way is "
                  "waited for, then each run's policy is evaluated",
                  to_seconds(*study_.stop_after), num_applied_));
}

/// What an earlier incarnation has counted counts.
void LearnerCore::on(const Turn& turn, const TimeRecovered& event) {
  const LearningTime& time = event.time;
  if (!study_.stop_after) {
    return fail("the journal counts the time of a study that has no stop_after_s");
  }
  if (time.elapsed < learnt_.elapsed) {
    return fail(fmt::format("the journal counts {:g} s of learning after {:g} s",
                            to_seconds(time.elapsed), to_seconds(learnt_.elapsed)));
  }
  pass_time(turn, time);
}

void LearnerCore::on(const Turn& turn, const RecoveryFinished&) {
  CHECK(!at_work_since_, "a recovery is finished once");
  at_work_since_ = turn.now;
  learnt_before_ = learnt_.elapsed;
}

}  // namespace treeroll::learner
