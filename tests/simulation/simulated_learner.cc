#include "tests/simulation/simulated_learner.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "common/protocol/pieces.h"
#include "common/protocol/timings.h"
#include "common/protocol/wire_sizes.h"
#include "common/transport/codec.h"

namespace treeroll::simulation {
namespace {

constexpr std::uint32_t kLearnerDice = 10;

learner::LearnerSettings learner_settings(const Scenario& scenario, protocol::LearnerId id) {
  learner::LearnerSettings settings;
  settings.learner_id = id;
  settings.batch_bytes_max = scenario.batch_bytes_max;
  settings.word_bytes = scenario.has_keys ? protocol::kWordMacBytes : 0;
  settings.is_authenticated = scenario.has_keys;
  settings.unsynced_results_max = scenario.unsynced_results_max;
  if (scenario.knows_task) {
    settings.known_tasks[kTaskContent] =
        *task_description_from_json(task_description(scenario.task));
  }
  return settings;
}

}  // namespace

SimulatedLearner::SimulatedLearner(const Scenario& scenario, int index, Schedule& schedule,
                                   Observer& observer, Disk& disk, int generation,
                                   Surroundings surroundings)
    : Node(schedule, scenario.reading_delay),
      scenario_(scenario),
      study_(scenario.studies[static_cast<std::size_t>(index)]),
      observer_(observer),
      disk_(disk),
      surroundings_(std::move(surroundings)),
      dice_(scenario.seed, kLearnerDice + static_cast<std::uint32_t>(index),
            static_cast<std::uint32_t>(generation)),
      id_(dice_.id()),
      task_(scenario.seed, scenario.task),
      core_(study_, learner_settings(scenario, id_)),
      num_applied_(static_cast<std::size_t>(study_.num_runs())) {}

void SimulatedLearner::start() {
  learner::Effects unsent;
  started_at_ = schedule_.now();
  core_.step(schedule_.now(), learner::Started{}, unsent);
  const std::string damage = disk_.open([this](const JournalRecord& record) { recover(record); });
  observer_.require(damage.empty(), "its own journal cannot be read: " + damage);
  observer_.require(core_.outcome() != learner::LearnerCore::Outcome::kFailed,
                    "its own journal is refused: " + core_.failure());
  disk_.append(JournalStart{.learner_id = id_});
  disk_.sync();
  check_counters();
  step(learner::RecoveryFinished{});
  step(learner::TimerFired{});
}

void SimulatedLearner::recover(const JournalRecord& record) {
  if (core_.outcome() == learner::LearnerCore::Outcome::kFailed) return;
  learner::Effects unsent;
  if (const auto* result = std::get_if<AcceptedResult>(&record)) {
    note_answered(*result);
    accepted_.emplace(result->key, result->content);
    synced_.emplace(result->key, result->content);
    core_.step(schedule_.now(), learner::ResultRecovered{*result}, unsent);
  } else if (const auto* worker = std::get_if<KnownWorker>(&record)) {
    core_.step(schedule_.now(), learner::WorkerRecovered{*worker}, unsent);
  } else if (const auto* time = std::get_if<LearningTime>(&record)) {
    learnt_before_ = time->elapsed;
    note_time(*time);
    core_.step(schedule_.now(), learner::TimeRecovered{*time}, unsent);
  }
}

void SimulatedLearner::stop() {
  later(Duration{}, [this] { step(learner::StopRequested{}); });
}

void SimulatedLearner::on_inbox(std::vector<MessagePointer> messages) {
  for (const MessagePointer& message : messages) {
    take(learner::MessageReceived{*message});
    hear(*message);
  }
  step(learner::InboxDrained{});
}

void SimulatedLearner::on_timer() {
  step(learner::TimerFired{});
  check_leases_of_the_silent();
}

void SimulatedLearner::step(const learner::Event& event) {
  take(event);
  if (dead_ || ended_) return;
  if (core_.outcome() == learner::LearnerCore::Outcome::kRunning)
    return wake_at(core_.next_deadline());
  observer_.require(core_.outcome() != learner::LearnerCore::Outcome::kFailed,
                    "the learner fails: " + core_.failure());
  if (is_sync_planned_) return;  // end_sync() comes
  disk_.append(JournalSeal{});
  disk_.sync();
  ended_ = true;
  surroundings_.ended();
}

void SimulatedLearner::take(const learner::Event& event) {
  if (dead_) return;
  learner::Effects effects;
  core_.step(schedule_.now(), event, effects);
  do_all(effects);
  if (!dead_) check_counters();
}

void SimulatedLearner::do_all(const learner::Effects& effects) {
  int count = 0;
  for (const learner::Effect& effect : effects) {
    if (std::holds_alternative<learner::SendMessage>(effect)) count += 1;
    const bool is_record = std::holds_alternative<learner::AppendResult>(effect) ||
                           std::holds_alternative<learner::AppendWorker>(effect) ||
                           std::holds_alternative<learner::AppendTime>(effect);
    if (is_record) count += 2;
  }
  effects_until_crash_ = crash_is_due_ && count > 0 ? dice_.between(0, count) : -1;
  try {
    learner::carry_out(effects, *this);
    if (effects_until_crash_ >= 0) crash();
  } catch (const Crashed&) {
    crash();
  }
}

void SimulatedLearner::crash_if_due() {
  if (effects_until_crash_-- == 0) throw Crashed{};
}

void SimulatedLearner::crash() {
  dead_ = true;
  switch (disk_.crash(dice_)) {
    case Disk::Loss::kTorn:
      observer_.count("journal tails torn");
      break;
    case Disk::Loss::kZeros:
      observer_.count("journal tails reading as zeros");
      break;
    case Disk::Loss::kNothing:
      break;
  }
  surroundings_.crashed();
}

void SimulatedLearner::append(const AcceptedResult& result) {
  crash_if_due();
  const auto expected = expected_.find(result.key);
  observer_.require(expected != expected_.end(), "a result that nobody asked for is accepted");
  if (expected != expected_.end()) {
    observer_.require(expected->second.content == result.content,
                      "the answer to another question is accepted");
    const Outcome& outcome = expected->second.outcome;
    observer_.require(outcome.reward() == result.outcome.reward(), "a wrong reward is accepted");
    observer_.require(outcome.status() == result.outcome.status(), "a wrong status is accepted");
  }
  observer_.require(accepted_.emplace(result.key, result.content).second,
                    "a roll-out is accepted twice");
  if (result.outcome.is_discarded()) expected_.erase(result.key);
  disk_.append(result);
  unwritten_.push_back(result);
  note_answered(result);
  plan_sync();
  observer_.require(lag() <= scenario_.unsynced_results_max,
                    "more is accepted than may wait for the disk");
  if (lag() == scenario_.unsynced_results_max) observer_.count("the disk's lag at its limit");
}

void SimulatedLearner::append(const KnownWorker& worker) {
  crash_if_due();
  disk_.append(worker);
  plan_sync();
}

void SimulatedLearner::append(const LearningTime& time) {
  crash_if_due();
  observer_.require(time.elapsed == learnt_before_ + (schedule_.now() - started_at_),
                    "the time of learning is not counted");
  disk_.append(time);
  time_is_unwritten_ = true;
  note_time(time);
  plan_sync();
}

void SimulatedLearner::flush() {
  crash_if_due();
  write();
}

void SimulatedLearner::write() {
  disk_.flush();
  for (const AcceptedResult& result : std::exchange(unwritten_, {})) {
    unsynced_.emplace_back(result.key, result.content);
  }
  time_is_unwritten_ = false;
}

void SimulatedLearner::plan_sync() {
  is_unsynced_ = true;
  if (std::exchange(is_sync_planned_, true)) return;
  later(scenario_.sync_delay, [this] { begin_sync(); });
}

void SimulatedLearner::begin_sync() {
  if (dead_) return;
  is_unsynced_ = false;
  write();
  disk_.begin_sync();
  syncing_ = std::exchange(unsynced_, {});
  step(learner::SyncBegun{});
  later(scenario_.sync_delay, [this] { end_sync(); });
}

void SimulatedLearner::end_sync() {
  if (dead_) return;
  is_sync_planned_ = false;
  disk_.end_sync();
  synced_.insert(syncing_.begin(), syncing_.end());
  syncing_.clear();
  if (is_unsynced_) plan_sync();
  step(learner::JournalSynced{});
}

void SimulatedLearner::send(const protocol::Message& message) {
  crash_if_due();
  observer_.require(unwritten_.empty() && !time_is_unwritten_,
                    "a message leaves before what it may follow from is written");
  if (const auto* batch = std::get_if<protocol::RolloutBatch>(&message)) check_batch(*batch);
  check_told(message);
  surroundings_.send(std::make_shared<const protocol::Message>(message));
}

void SimulatedLearner::note_answered(const AcceptedResult& result) {
  const protocol::RolloutKey key = result.key;
  open_.erase(key);
  if (result.outcome.is_discarded() && ++num_discards_[key] <= study_.discards_max) return;
  if (result.outcome.is_discarded()) observer_.count("roll-outs given up");
  answered_.emplace(key, result.outcome);
  if (key.number < 0) return;
  int& applied = num_applied_[static_cast<std::size_t>(key.run)];
  const auto apply = [&](int number) {
    ++applied;
    num_failed_ += answered_.at({key.run, number}).is_ok() ? 0 : 1;
  };
  if (!study_.in_sequence) return apply(key.number);
  while (answered_.contains({key.run, applied})) apply(applied);
}

void SimulatedLearner::note_time(const LearningTime& time) {
  observer_.require(study_.stop_after.has_value(), "a time is noted for a study without an end");
  if (!study_.stop_after || time.elapsed < *study_.stop_after) return;
  observer_.require(!ends_, "the time of a study is up twice");
  ends_ = num_applied_;
}

/// One of its applied roll-outs was discarded too often.
bool SimulatedLearner::is_given_up(int run) const {
  return std::any_of(answered_.begin(), answered_.end(), [&](const auto& answer) {
    const auto& [key, outcome] = answer;
    const bool is_applied =
        !study_.in_sequence || key.number < num_applied_[static_cast<std::size_t>(run)];
    return key.run == run && key.number >= 0 && is_applied && outcome.is_discarded();
  });
}

/// What is asked for belongs to a run that may still draw, or is the evaluation of one that has
/// ended.
void SimulatedLearner::check_ends(protocol::RolloutKey key) {
  const auto run = static_cast<std::size_t>(key.run);
  const explore::ExplorationSettings& exploration = condition_of(study_, key.run).exploration;
  if (key.number == learner::Run::kStart) return;
  if (key.number < 0) {
    observer_.require(
        ends_ || is_given_up(key.run) || num_applied_[run] == exploration.num_rollouts,
        "a run is evaluated that has not ended");
  } else if (ends_) {
    observer_.require(key.number < (*ends_)[run] + exploration.in_flight,
                      "a roll-out is drawn although the time is up");
  }
}

/// As the request has it, or as it names it.
std::vector<double> SimulatedLearner::theta_of(const protocol::RolloutRequest& request) {
  if (!request.theta_id) return request.theta;
  const Eigen::VectorXd& drawn = core_.ledger().find(request.key)->question.theta;
  std::vector<double> theta(drawn.begin(), drawn.end());
  observer_.require(content_hash(protocol::content_of_theta(theta)) == *request.theta_id,
                    "a request names another theta");
  observer_.count("thetas in pieces");
  return theta;
}

void SimulatedLearner::check_batch(const protocol::RolloutBatch& batch) {
  observer_.require(batch.sequence == ++last_sequence_, "a batch out of sequence");
  if (batch.rollouts.size() > 1) {
    observer_.require(transport::encode(batch).size() <= scenario_.batch_bytes_max,
                      "a batch is larger than it may be");
  }
  for (const protocol::RolloutRequest& request : batch.rollouts) {
    const protocol::RolloutKey key = request.key;
    observer_.require(hearing_.contains(request.worker_id),
                      "a roll-out is leased to a worker that has not said that it hears");
    observer_.require(!answered_.contains(key), "an answered roll-out is asked for");
    const explore::ExplorationSettings& exploration = condition_of(study_, key.run).exploration;
    const int applied = num_applied_[static_cast<std::size_t>(key.run)];
    observer_.require(key.number < exploration.num_rollouts,
                      "a roll-out past the budget is asked for");
    observer_.require(key.number < applied + exploration.in_flight,
                      "more roll-outs are in flight than the journal permits");
    check_ends(key);
    const auto [place, is_new] = expected_.emplace(
        key, Expected{request.content, task_.outcome(key, request.task_seed, theta_of(request))});
    observer_.require(is_new || place->second.content == request.content,
                      "a roll-out is asked again with another question");
    const auto num_discards = num_discards_.find(key);
    const int trial = num_discards == num_discards_.end() ? 0 : num_discards->second;
    observer_.require(request.task_seed == learner::task_seed(study_, key.run % study_.repetitions,
                                                              key.number, trial),
                      "a trial has not the seed of its number");
    open_.insert(key);
  }
  for (const protocol::Acknowledgement& acknowledgement : batch.acknowledgements) {
    greeted_.try_emplace(acknowledgement.worker_id, batch.sequence);
    observer_.require(acknowledgement.seen_index <= heard_[acknowledgement.worker_id].arrived.last,
                      "an answer is said to be seen that has not arrived");
    observer_.require(acknowledgement.result_index <= acknowledgement.seen_index,
                      "an answer is settled before it is seen");
    std::int64_t& settled = observer_.settled[{acknowledgement.worker_id, id_}];
    settled = std::max(settled, acknowledgement.result_index);
    auto& answers = observer_.answers[{acknowledgement.worker_id, id_}];
    while (!answers.empty() && answers.begin()->first <= acknowledgement.result_index) {
      observer_.require(synced_.contains(answers.begin()->second),
                        "an answer is acknowledged that is not on stable storage");
      answers.erase(answers.begin());
    }
  }
}

void SimulatedLearner::check_told(const protocol::Message& message) {
  const char* const rule = "a result is told of that is not in the journal";
  if (const auto* run = std::get_if<protocol::RunStatus>(&message)) {
    observer_.require(run->num_applied == num_applied_[static_cast<std::size_t>(run->run)], rule);
  } else if (const auto* learner = std::get_if<protocol::LearnerStatus>(&message)) {
    observer_.require(learner->num_applied == std::accumulate(num_applied_.begin(),
                                                              num_applied_.end(), std::int64_t{0}),
                      rule);
  }
}

void SimulatedLearner::check_counters() {
  const LedgerCounters counters = core_.counters();
  const auto applied = std::accumulate(num_applied_.begin(), num_applied_.end(), std::int64_t{0});
  // After a failure or the end, and within recovery, nothing is drawn any more.
  observer_.require(counters.applied == applied, "applied results are not what the journal has");
  observer_.require(counters.issued == counters.applied + counters.pending,
                    "issued is not applied and pending");
  observer_.require(counters.pending >= 0 && counters.pending <= num_in_flight(study_),
                    "more is pending than may be in flight");
  observer_.require(counters.failed == num_failed_, "failed results are not those applied");
  observer_.require(counters.rejected == 0 && counters.conflicting == 0,
                    "a sound worker's answer is rejected");
  observer_.count("answers of strangers refused",
                  counters.unasked - std::exchange(num_unasked_, counters.unasked));
  observer_.num_reissued += counters.reissued - std::exchange(num_reissued_, counters.reissued);
}

void SimulatedLearner::Heard::Indices::take(const protocol::RewardBatch& batch, bool with_results) {
  for (std::size_t i = 0; with_results && i < batch.results.size(); ++i) {
    past_gap.insert(batch.first_index + static_cast<std::int64_t>(i));
  }
  last = std::max(last, batch.oldest_index - 1);
  while (!past_gap.empty() && *past_gap.begin() <= last + 1) {
    last = std::max(last, *past_gap.begin());
    past_gap.erase(past_gap.begin());
  }
}

void SimulatedLearner::hear(const protocol::Message& message) {
  if (const auto* batch = std::get_if<protocol::RewardBatch>(&message);
      batch && batch->learner_id == id_) {
    heard_[batch->worker_id].arrived.take(*batch, true);  // also when it was the last one
  }
  if (dead_ || core_.outcome() != learner::LearnerCore::Outcome::kRunning) return;
  if (const auto* status = std::get_if<protocol::WorkerStatus>(&message)) {
    heard_[status->worker_id].time = schedule_.now();
    check_lost_requests(*status);
  } else if (const auto* batch = std::get_if<protocol::RewardBatch>(&message)) {
    if (batch->learner_id != id_) return;
    Heard& heard = heard_[batch->worker_id];
    heard.time = schedule_.now();
    heard.surely_read.take(*batch, lag() < scenario_.unsynced_results_max);
  } else if (const auto* request = std::get_if<protocol::DefinitionRequest>(&message)) {
    if (request->learner_id == id_) heard_[request->worker_id].time = schedule_.now();
  } else if (const auto* report = std::get_if<protocol::DefinitionReport>(&message)) {
    if (report->learner_id == id_) heard_[report->worker_id].time = schedule_.now();
  }
}

/// A worker has read a later batch, all its answers are in, and it holds the roll-out no more.
void SimulatedLearner::check_lost_requests(const protocol::WorkerStatus& status) {
  const auto held = std::find_if(status.held.begin(), status.held.end(),
                                 [this](const auto& of) { return of.learner_id == id_; });
  if (held == status.held.end()) return;
  const auto greeted = greeted_.find(status.worker_id);
  if (greeted != greeted_.end() && held->last_batch >= greeted->second) {
    hearing_.insert(status.worker_id);
  }
  if (held->last_index > heard_[status.worker_id].surely_read.last) return;
  for (const protocol::RolloutKey key : open_) {
    if (key < held->first || key > held->last) continue;
    const learner::Ledger::Entry* entry = core_.ledger().find(key);
    const learner::Ledger::Lease* lease = entry ? entry->lease_of(status.worker_id) : nullptr;
    const bool stays = lease && lease->batch <= held->last_batch;
    observer_.require(
        !stays || std::find(held->keys.begin(), held->keys.end(), key) != held->keys.end(),
        "a roll-out stays leased to a worker that says it does not have it");
  }
}

void SimulatedLearner::check_leases_of_the_silent() {
  if (dead_ || core_.outcome() != learner::LearnerCore::Outcome::kRunning) return;
  for (const protocol::RolloutKey key : open_) {
    const learner::Ledger::Entry* entry = core_.ledger().find(key);
    if (!entry) continue;
    for (const learner::Ledger::Lease& lease : entry->leases) {
      observer_.require(heard_[lease.worker].time + protocol::kWorkerSilence > schedule_.now(),
                        "a roll-out stays leased to a worker that has left");
    }
  }
}

}  // namespace treeroll::simulation
