#include "learner/app/export_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "common/protocol/pieces.h"
#include "common/protocol/timings.h"
#include "common/protocol/wire_sizes.h"
#include "common/transport/codec.h"
#include "learner/app/event_log.h"
#include "learner/core/run_messages.h"

namespace treeroll {
namespace {

using protocol::DefinitionKind;

constexpr double kStatusPeriodSeconds =
    std::chrono::duration<double>(protocol::kLearnerStatusPeriod).count();

/// Times of a journal are anybody's: their difference may be no integer of theirs.
double seconds_between(std::int64_t from_us, std::int64_t to_us) {
  return (static_cast<double>(to_us) - static_cast<double>(from_us)) / 1e6;
}

struct KnownAnswerer {
  protocol::WorkerStatus status;
  std::int64_t num_results = 0;  ///< for the learner whose start came last
};

/// Follows a fold, and writes the messages of each record.
class StudyMessages {
 public:
  explicit StudyMessages(const std::filesystem::path& output_file) : log_(output_file) {}

  void at(std::int64_t wall_time_us) { time_us_ = wall_time_us; }

  void before(const learner::LearnerCore& core, const JournalRecord& record) {
    if (const auto* start = std::get_if<JournalStart>(&record)) begin(core, *start);
    if (const auto* worker = std::get_if<KnownWorker>(&record)) join(*worker);
    const auto* result = std::get_if<AcceptedResult>(&record);
    if (!result) return;
    const learner::Ledger::Entry* open = core.ledger().find(result->key);
    if (!open) return;
    if (result->key.number >= 0) {
      ask_and_answer(core, *result, open->question);
    } else {
      evaluation_asked_ = open->question;
    }
  }

  void applied(const learner::LearnerCore& core, const learner::Run& run) {
    send(learner::run_status(run, core.study(), learner_id_));
    const explore::Exploration::Best& best = run.exploration().best();
    if (best.rollout < 0) return;
    const auto [known, is_first] = best_.try_emplace(run.index(), best.rollout);
    if (!is_first && std::exchange(known->second, best.rollout) == best.rollout) return;
    for (protocol::BestPolicy& piece : learner::best_policy(run, core.study(), learner_id_)) {
      send(std::move(piece));
    }
  }

  void after(const learner::LearnerCore& core, const JournalRecord& record) {
    const auto* result = std::get_if<AcceptedResult>(&record);
    if (result && result->key.number < 0) {
      // One that an extension has superseded has left the question open, and answers no other.
      const auto asked = std::exchange(evaluation_asked_, std::nullopt);
      if (asked && (result->outcome.is_discarded() || !core.is_unanswered(result->key))) {
        ask_and_answer(core, *result, *asked);
      }
      send(learner::run_status(core.runs()[static_cast<std::size_t>(result->key.run)], core.study(),
                               learner_id_));
    }
    // A clock that went back must not silence it. Written so that no forged time overflows.
    if (time_us_ < status_us_ || seconds_between(status_us_, time_us_) >= kStatusPeriodSeconds) {
      send_status(core);
    }
  }

  void finish(const learner::LearnerCore& core) {
    for (const auto& [id, worker] : workers_) send(worker.status);
    send_status(core);
    log_.commit();
  }

 private:
  void send(const protocol::Message& message) {
    const std::string channel = fmt::format(
        "{}{}", kReplayedPrefix, transport::channel_name(transport::channel_of(message)));
    log_.append(time_us_, channel, transport::encode(message));
  }

  void begin(const learner::LearnerCore& core, const JournalStart& start) {
    learner_id_ = start.learner_id;
    started_us_ = time_us_;
    last_batch_ = 0;
    heard_.clear();
    for (auto& [id, worker] : workers_) worker.num_results = 0;
    send_status(core);
  }

  void join(const KnownWorker& worker) {
    heard_.insert(worker.worker_id);
    protocol::WorkerStatus& status = workers_[worker.worker_id].status;
    status.worker_id = worker.worker_id;
    status.host = worker.host;
    status.pid = worker.pid;
    status.numeric_class = worker.numeric_class;
    send(status);
  }

  void ask_and_answer(const learner::LearnerCore& core, const AcceptedResult& result,
                      const learner::Question& question) {
    const learner::Run& run = core.runs()[static_cast<std::size_t>(result.key.run)];
    const Condition& condition = core.study().conditions[static_cast<std::size_t>(run.condition())];
    define({DefinitionKind::kTask, question.task_id}, [&] { return condition.task_content; });
    define({DefinitionKind::kPolicy, question.policy_id},
           [&] { return to_json(run.exploration().policy(run.layer_of(result.key.number))); });
    const std::vector<double> theta(question.theta.begin(), question.theta.end());
    protocol::RolloutRequest request{.worker_id = result.worker_id,
                                     .key = result.key,
                                     .content = question.content,
                                     .task_id = question.task_id,
                                     .policy_id = question.policy_id,
                                     .task_seed = question.task_seed,
                                     .theta = theta};
    if (protocol::kFrameBytesMax + protocol::kRolloutBatchBytes +
            protocol::rollout_request_bytes(theta.size()) >
        protocol::kBatchBytesRemoteMax) {
      const std::string content = protocol::content_of_theta(theta);
      request.theta.clear();
      request.theta_id = content_hash(content);
      define({DefinitionKind::kTheta, *request.theta_id}, [&] { return content; });
    }
    send(protocol::RolloutBatch{.learner_id = learner_id_,
                                .sequence = ++last_batch_,
                                .rollouts = {std::move(request)},
                                .acknowledgements = {}});
    heard_.insert(result.worker_id);
    KnownAnswerer& worker = workers_[result.worker_id];
    worker.status.worker_id = result.worker_id;
    ++worker.status.num_evaluated;
    if (!result.outcome.is_ok()) ++worker.status.num_failed;
    const std::int64_t index = ++worker.num_results;
    send(protocol::RewardBatch{.worker_id = result.worker_id,
                               .learner_id = learner_id_,
                               .last_batch = last_batch_,
                               .batches_received = 1,
                               .oldest_index = index,
                               .first_index = index,
                               .results = {{.key = result.key,
                                            .content = question.content,
                                            .outcome = result.outcome,
                                            .duration_ns = result.duration_ns.value_or(0)}}});
  }

  /// All pieces, once for each learner.
  template <class Content>
  void define(const protocol::DefinitionName& name, const Content& content_of) {
    if (!defined_.emplace(learner_id_, name).second) return;
    const std::string content = content_of();
    for (int index = 0; index < protocol::num_pieces(content.size()); ++index) {
      send(protocol::definition_piece(learner_id_, name, content, index));
    }
  }

  void send_status(const learner::LearnerCore& core) {
    status_us_ = time_us_;
    protocol::LearnerStatus status = core.status(TimePoint{});
    status.learner_id = learner_id_;
    status.waiting_for.clear();  // a fold hears of no workers, and waits for nothing
    status.elapsed_s = std::max(seconds_between(started_us_, time_us_), 0.0);
    status.num_workers = static_cast<std::int32_t>(heard_.size());
    send(std::move(status));
  }

  EventLog log_;
  std::int64_t time_us_ = 0;     // of the record
  std::int64_t started_us_ = 0;  // of the learner whose start came last
  std::int64_t status_us_ = 0;   // of the last status
  protocol::LearnerId learner_id_ = 0;
  std::int64_t last_batch_ = 0;
  std::optional<learner::Question> evaluation_asked_;  // by the record at hand
  std::map<protocol::WorkerId, KnownAnswerer> workers_;
  std::set<protocol::WorkerId> heard_;  // by that learner
  std::set<std::pair<protocol::LearnerId, protocol::DefinitionName>> defined_;
  std::map<int, int> best_;  // by run, the roll-out that was told last
};

}  // namespace

void export_messages(const StateFiles& files, const std::filesystem::path& output_file) {
  const StateStudy state = read_state_study(files);
  StudyMessages messages(output_file);
  const learner::LearnerCore* folded = nullptr;
  learner::LearnerSettings settings;
  settings.on_applied = [&](const learner::Run& run, int) { messages.applied(*folded, run); };
  learner::LearnerCore core(state.loaded.study, settings);
  folded = &core;
  fold_state(files, state, TimePoint{}, core,
             {.at = [&](std::int64_t wall_time_us) { messages.at(wall_time_us); },
              .before = [&](const JournalRecord& record) { messages.before(core, record); },
              .after = [&](const JournalRecord& record) { messages.after(core, record); }});
  messages.finish(core);
}

}  // namespace treeroll
