#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "common/base/content_hash.h"
#include "common/transport/channel.h"
#include "learner/core/carry_out.h"
#include "learner/core/learner_core.h"
#include "learner/journal/journal_file.h"
#include "tests/files/scratch_folder.h"
#include "tests/learner_core/fake_worker.h"

namespace treeroll::benchmarks {

/// How results reach the learner.
struct Traffic {
  int results_a_message = 1;
  int messages_a_turn = 1;  ///< read before the learner answers
};

/// What a learner daemon does, without sockets: messages are decoded, stepped through the core, its
/// results written to a journal, and what it says is encoded. Only this is timed. A worker
/// that answers at once stands on the other side and holds up to 64 roll-outs. There is no
/// fdatasync: its time is the disk's.
class LearnerLoop : private learner::EffectHandler {
 public:
  /// @param journal  a file that is not there yet
  LearnerLoop(const Study& study, const Traffic& traffic, const std::filesystem::path& journal);

  /// Until so many more results are accepted.
  /// @return  processor time of the learner
  std::chrono::nanoseconds learn(std::int64_t num_results);

  int num_runs() const { return static_cast<int>(core_->runs().size()); }
  std::int64_t num_results() const { return num_results_; }
  std::int64_t num_messages_sent() const { return num_messages_sent_; }
  std::int64_t num_bytes_sent() const { return num_bytes_sent_; }
  /// How the journal knows the study.
  static ContentHash study_id();

 private:
  struct Encoded {
    transport::Channel channel;
    std::vector<std::byte> bytes;
  };

  void append(const AcceptedResult& result) override;
  void append(const SecondAnswer& answer) override;
  void append(const KnownWorker& worker) override;
  void append(const TaskSignals& signals) override;
  void append(const LearningTime& time) override;
  void flush() override { journal_.flush(); }
  void send(const protocol::Message& message) override;
  void log(const LogLine& line) override;

  void step(const learner::Event& event);
  /// What the worker says next; it has read all that was sent.
  std::vector<protocol::Message> answers();
  std::chrono::nanoseconds take(const std::vector<Encoded>& messages);

  Traffic traffic_;
  JournalWriter journal_;
  std::unique_ptr<learner::LearnerCore> core_;
  learner::FakeWorker worker_;
  std::int64_t last_index_ = 0;  ///< of the last result it has sent
  std::vector<Encoded> sent_;
  TimePoint now_{};
  TimePoint next_heartbeat_{};
  std::int64_t num_results_ = 0;
  std::int64_t num_messages_sent_ = 0;
  std::int64_t num_bytes_sent_ = 0;
};

}  // namespace treeroll::benchmarks
