#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/base/content_hash.h"
#include "common/base/time.h"
#include "common/protocol/limits.h"
#include "common/protocol/messages.h"
#include "common/protocol/timings.h"
#include "learner/core/hearing.h"
#include "learner/core/ledger.h"
#include "learner/core/requests_sent.h"
#include "learner/core/results_read.h"
#include "learner/core/run_record.h"

namespace treeroll::learner {

/// A worker that has refused a definition is asked again after this: the reason may have passed.
inline constexpr Duration kRefusalLasts = std::chrono::seconds(60);

/// What the learner knows of one worker.
struct WorkerEntry {
  protocol::WorkerId id = 0;
  std::string host;
  int pid = 0;
  std::string numeric_class;
  int num_evaluators = 0;  ///< 0 until its first heartbeat
  int free_slots = 0;      ///< as last reported, less what was issued since
  int receive_buffer_bytes = 0;
  bool draining = false;
  bool distrusted = false;  ///< gave an answer no sound worker gives, and has said it was its own
  TimePoint trusted_again;  ///< then
  int num_distrusts = 0;    ///< since its last good answer
  /// An answer no sound worker gives came in its name: its next word tells whether it was its own.
  struct Suspicion {
    std::int64_t index = 0;
    protocol::RolloutKey key;
  };
  std::optional<Suspicion> suspicion;
  bool set_aside = false;    ///< others have outvoted it: it gets nothing of this study
  bool asked = false;        ///< has been leased something, ever
  bool other_class = false;  ///< than the one that the study demands
  bool is_known = false;     ///< has a key, so it has what it says
  bool joined = false;       ///< has answered this learner, and it has been said
  bool late = false;         ///< has what took too long elsewhere, and has answered nothing since
  Hearing hearing;
  /// The class under which the journal knows it; nothing while it has no result there.
  std::optional<std::string> noted_class;
  std::int64_t arrival = 0;  ///< running number: who has a smaller one has come before it
  TimePoint first_heard;
  TimePoint last_heard;
  Duration alive_for = protocol::kWorkerAlive;  ///< since then, as the table knows it
  struct Refusal {
    std::string reason;
    TimePoint until;  ///< it is asked again after this
    /// It describes the task otherwise than the learner has it: no answer shows the contrary, only
    /// another description.
    bool by_description = false;
  };
  std::map<ContentHash, Refusal> refused;  ///< by definition
  std::set<ContentHash> described;         ///< tasks of which it has said what they are
  /// From issue to answer, running median; nothing before the first answer.
  std::optional<double> answer_time_s;
  ResultsRead results_read;
  std::int64_t last_index_settled = 0;  ///< all its results up to this one are on stable storage
  std::int64_t last_index_syncing = 0;  ///< the same once the sync under way has ended
  RequestsSent requests_sent;
  std::int64_t num_accepted = 0;

  /// It has refused neither.
  bool knows(const ContentHash& task, const ContentHash& policy) const {
    return !refused.contains(task) && !refused.contains(policy);
  }
  /// Its rewards may be those of another task.
  bool describes_otherwise(const ContentHash& task) const {
    const auto refusal = refused.find(task);
    return refusal != refused.end() && refusal->second.by_description;
  }
  /// And has not answered it already.
  bool may_have(const Question& question) const {
    return knows(question.task_id, question.policy_id) && !question.was_answered_by(id);
  }
  /// Neither it nor another of its host or key has answered it: its word is one more witness's.
  bool is_new_witness(const Question& question) const;
  /// As the journal is to know it.
  KnownWorker as_known() const;
  /// One that refuses so much is asked for nothing until it has been forgotten what it refused.
  bool refuses_too_much() const { return refused.size() >= protocol::kRefusalsPerWorkerMax; }
  bool usable() const {
    return num_evaluators > 0 && !draining && !distrusted && !set_aside && !other_class &&
           !refuses_too_much() && hearing.hears();
  }
  /// Nothing speaks against it: others of whom that is true are no better.
  bool is_first_choice() const { return hearing.is_first_choice() && !late; }
  bool is_alive(TimePoint now) const { return now < last_heard + alive_for; }
  /// It has answered a greeting. Greetings can be heard by all, and so answered in made-up names.
  bool has_answered_a_greeting() const { return joined || asked || num_accepted > 0; }
  /// As many as it has shown that it has, by its answers; else anybody could say that he has all.
  /// With keys too: who holds a worker's key has names without number.
  int evaluators_shown() const {
    const std::int64_t shown = protocol::kEvaluatorsUnshownMax * (num_accepted + 1);
    return static_cast<int>(std::min<std::int64_t>(num_evaluators, shown));
  }
};

/// Its name for a person: id, host and process.
std::string describe(const WorkerEntry& worker);

/// Every worker heard of lately, by id.
class WorkerTable {
 public:
  /// @param has_keys  names of one key begin alike, and only who has it can take them
  explicit WorkerTable(bool has_keys = false) : has_keys_(has_keys) {}

  /// The entry of a worker that was heard just now; made if new. Null when kWorkersMax are there
  /// that have answered something, or kWorkersOfOneKeyMax of them whose names begin as its: it is
  /// refused until one of them leaves.
  WorkerEntry* hear(protocol::WorkerId id, TimePoint now);
  /// Who has made room since the last call: it may have leases.
  std::vector<protocol::WorkerId> take_put_out() { return std::exchange(put_out_, {}); }
  WorkerEntry* find(protocol::WorkerId id);

  /// They are told that they are so many: their heartbeats stretch accordingly, and what their
  /// silence means from now on. It shrinks slowly, for some may not have heard the last word.
  void note_told(TimePoint now, int num_workers);
  const protocol::Heartbeats& heartbeats() const { return heartbeats_; }

  /// Takes out the workers that have been silent for too long; their records stay.
  std::vector<WorkerEntry> remove_silent(TimePoint now);
  /// When to call remove_silent() next: no worker counts as silent before.
  std::optional<TimePoint> next_look() const { return look_at_; }

  /// @return  tasks that workers describe otherwise, due to be asked for again: that is not
  /// forgotten
  std::set<ContentHash> forget_refusals(TimePoint now);
  /// Those whose time is up. @return who they are
  std::vector<const WorkerEntry*> trust_again(TimePoint now);

  std::map<protocol::WorkerId, WorkerEntry>& all() { return workers_; }
  const std::map<protocol::WorkerId, WorkerEntry>& all() const { return workers_; }
  bool is_full() const { return workers_.size() >= protocol::kWorkersMax; }
  /// Those that have answered this learner, and their evaluators.
  int num_joined() const;
  int num_evaluators() const;

  /// Workers that have left and those present, for the summary.
  std::vector<WorkerRecord> records(TimePoint start) const;

 private:
  using Arrival = std::pair<std::int64_t, protocol::WorkerId>;
  /// Those present that share a limit: all, and with keys also those whose names begin alike.
  struct Group {
    explicit Group(std::size_t limit) : num_max(limit) {}
    bool is_full() const { return num_present >= num_max; }

    std::size_t num_max;
    std::size_t num_present = 0;
    std::set<Arrival> newcomers;  ///< till room has to be made, whatever they have answered
    std::set<Arrival> greeted;    ///< were newcomers then, and had answered a greeting, no more
    TimePoint next_put_out;       ///< of one of these
  };

  bool has_room_for(protocol::WorkerId id, TimePoint now);
  bool make_room(Group& group, TimePoint now);
  void put_out(protocol::WorkerId id);
  std::vector<Group*> groups_of(protocol::WorkerId id);
  std::map<protocol::WorkerId, WorkerEntry>::iterator forget(
      std::map<protocol::WorkerId, WorkerEntry>::iterator worker);
  void make_room_among_those_that_left();

  bool has_keys_;
  /// Not after the first silence to come. Hearing of a worker puts its silence off but leaves this
  /// as it is, so that no message costs a walk over all workers.
  std::optional<TimePoint> look_at_;
  std::int64_t num_arrivals_ = 0;
  Group all_{protocol::kWorkersMax};
  std::map<std::int64_t, Group> of_key_;  ///< by the beginning of their names
  std::vector<protocol::WorkerId> put_out_;
  int num_told_ = 0;
  protocol::Heartbeats heartbeats_;
  std::map<protocol::WorkerId, WorkerEntry> workers_;
  std::map<protocol::WorkerId, WorkerEntry> left_;
};

}  // namespace treeroll::learner
