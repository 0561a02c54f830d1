#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/doctor/finding.h"
#include "common/protocol/messages.h"

namespace treeroll::doctor {

/// What is known of who has said something, besides its words.
struct Proof {
  bool is_unchecked = false;  ///< it is signed, and we have no key that could check it
  /// Of a learner, where we have a worker's key: why a worker with that key refuses what it says.
  std::optional<std::string> refusal = std::nullopt;
};

/// Who else is on the group, and whether they hear us. Speaks to workers as a learner does: a
/// batch without roll-outs, with a word to each of them. A worker that has read it names the batch
/// in its next status, so that both ways are shown to be open. It is leased nothing. One that signs
/// reads only a learner's words that are signed: without such a key it is not spoken to.
class GroupWatch {
 public:
  struct Settings {
    protocol::LearnerId id = 0;  ///< ours, random
    std::string version;         ///< of this program
    std::string group;           ///< for the words: "239.255.76.67, UDP port 7667"
    std::size_t batch_bytes_max = 0;
    std::size_t word_bytes = 0;  ///< of a batch, for each worker that it names
  };
  explicit GroupWatch(Settings settings);

  /// Our next word: to the workers that have not answered yet, at most as many as a batch holds;
  /// the others have their turn with the next.
  protocol::RolloutBatch greeting(TimePoint now);
  /// A batch as full of words as any, to nobody.
  protocol::RolloutBatch longest_batch(TimePoint now);
  /// Of any message that is heard, our own included.
  void take(TimePoint now, const protocol::Message& message, const Proof& proof = {});

  Findings findings() const;

 private:
  struct Worker {
    protocol::WorkerStatus status;
    Proof proof;
    bool hears_us = false;
    int num_heard = 0;  ///< statuses since it was greeted, to which it could have answered
    bool was_greeted = false;
  };

  struct Learner {
    protocol::LearnerStatus status;
    Proof proof;
  };

  protocol::RolloutBatch next_batch(TimePoint now);
  void say_echoes(Findings& findings) const;
  void say_learners(Findings& findings) const;
  void say_workers(Findings& findings) const;
  void say_classes(Findings& findings) const;

  Settings settings_;
  std::int64_t last_sequence_ = 0;
  std::map<std::int64_t, TimePoint> sent_;  ///< ours, until they come back
  std::set<std::int64_t> long_ones_;        ///< of these
  bool short_came_back_ = false;
  bool long_came_back_ = false;
  Duration fastest_echo_ = Duration::max();
  std::map<protocol::LearnerId, Learner> learners_;
  std::map<protocol::WorkerId, Worker> workers_;
  protocol::WorkerId last_greeted_ = 0;  ///< whose turn it was
};

}  // namespace treeroll::doctor
