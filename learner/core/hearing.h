#pragma once

#include <cstdint>

#include "common/base/time.h"

namespace treeroll::learner {

/// Whether a worker hears this learner. Its heartbeats prove that it speaks; so do those of a host
/// whose inbound packets are dropped, and those of a recording. So it is greeted, and leased
/// something once it says that it has read the batch with the greeting: nobody can have said that
/// before. Then leases that it neither confirms nor answers tell against it:
///
///   greeted --echo--> hears --lost leases: less and less--> doubted: greeted again, ever more
///      ^                ^ answers: as if nothing had been        seldom, then one lease at a time
///      +----------------+---------------------------------------------------------+
class Hearing {
 public:
  /// Whether it may be leased roll-outs.
  bool hears() const { return hears_; }
  /// Nothing speaks against it: others of whom that is true are no better.
  bool is_first_choice() const { return hears_ && num_lost_ < kLostOfSecondChoice; }
  /// How many of the roll-outs that it could have at once it may have.
  int share_of(int window) const;

  /// It has been heard and does not hear: whether to greet it now.
  bool greeting_due(TimePoint now) const;
  /// A word to it by name goes out in the batch of this sequence: a greeting, if one is due.
  void note_word(TimePoint now, std::int64_t batch);
  /// It says that it has read our batches up to this one. Whether it hears now and did not before.
  bool note_echo(std::int64_t last_batch);

  /// A lease was lost that it had not confirmed. Those issued before the last loss that counted are
  /// of the same mishap. Whether it is doubted from now on.
  bool note_lost(TimePoint now, TimePoint issued_at);
  /// It has answered a roll-out, or says for the first time that it holds it.
  void note_confirmed();

  /// Once until it answers: it is heard and has not heard several greetings.
  bool deafness_to_tell(TimePoint now);
  /// For so long that it is no accident.
  bool seems_deaf(TimePoint now) const;

 private:
  static constexpr int kLostOfSecondChoice = 2;

  bool hears_ = false;
  int num_lost_ = 0;        ///< mishaps in a row
  TimePoint last_lost_at_;  ///< meaningless while num_lost_ is 0
  int num_doubts_ = 0;      ///< in a row
  int num_greetings_ = 0;   ///< of this spell
  TimePoint first_greeted_at_;
  TimePoint last_greeted_at_;
  std::int64_t greeted_in_ = 0;  ///< sequence of the batch with the spell's first greeting
  bool told_ = false;
};

}  // namespace treeroll::learner
