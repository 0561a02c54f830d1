#include <algorithm>
#include <numeric>
#include <utility>

#include "common/protocol/pieces.h"
#include "common/protocol/timings.h"
#include "common/transport/codec.h"
#include "learner/core/dispatch.h"
#include "tests/simulation/simulated_learner.h"

namespace treeroll::simulation {

/// What every sound worker answers to this.
void SimulatedLearner::check_answer(const AcceptedResult& result) {
  const auto expected = expected_.find(result.key);
  observer_.require(expected != expected_.end(), "a result that nobody asked for is accepted");
  if (expected != expected_.end()) {
    observer_.require(expected->second.content == result.content,
                      "the answer to another question is accepted");
    if (observer_.liars.contains(result.worker_id)) return;
    const Outcome& outcome = expected->second.outcome;
    observer_.require(outcome.reward() == result.outcome.reward(), "a wrong reward is accepted");
    observer_.require(outcome.status() == result.outcome.status(), "a wrong status is accepted");
  }
}

/// Only who lies is outvoted.
void SimulatedLearner::check_outvoted() {
  for (const auto& [id, tally] : core_.workforce().rechecks().record().workers) {
    observer_.require(tally.num_outvoted == 0 || observer_.liars.contains(id),
                      "a sound worker is outvoted");
  }
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

/// It has a result: another worker may be asked, with the same question.
void SimulatedLearner::check_again(const protocol::RolloutRequest& request) {
  const protocol::RolloutKey key = request.key;
  observer_.require(learner::is_rechecked(study_, key.run % study_.repetitions, key.number) &&
                        !answered_by_[key].contains(request.worker_id) &&
                        accepted_.contains({key, request.content}),
                    "an answered roll-out is asked for");
  const learner::Ledger::Entry& entry = *core_.ledger().find(key);
  const auto& workers = core_.workforce().workers().all();
  const learner::WorkerEntry& asked = workers.at(request.worker_id);
  const bool is_elsewhere = asked.is_new_witness(entry.question);
  observer_.count(is_elsewhere ? "asked again on another host" : "asked again on one host");
  // Whoever had it before is asked again, and what is late goes to who is idle.
  if (is_elsewhere || request.attempt > 0 || entry.leases.size() > 1) return;
  const auto has_room = [&](const learner::WorkerEntry& worker) {
    const int share = worker.hearing.share_of(learner::window(worker, 0));
    return worker.free_slots > 0 &&
           share > static_cast<int>(learner::num_out(core_.ledger(), worker.id));
  };
  observer_.require(
      std::ranges::none_of(workers,
                           [&](const auto& each) {
                             const learner::WorkerEntry& worker = each.second;
                             return worker.usable() && worker.is_alive(schedule_.now()) &&
                                    worker.is_first_choice() && worker.may_have(entry.question) &&
                                    worker.is_new_witness(entry.question) && has_room(worker);
                           }),
      "the same host is asked again although another one has room");
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
    if (answered_.contains(key)) check_again(request);
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
      // Of who is set aside nothing is taken, nor to be said again.
      observer_.require(synced_.contains(answers.begin()->second) ||
                            observer_.liars.contains(acknowledgement.worker_id),
                        "an answer is acknowledged that is not on stable storage");
      answers.erase(answers.begin());
    }
  }
}

void SimulatedLearner::check_told(const protocol::Message& message) {
  const char* const rule = "a result is told of that is not in the journal";
  if (const auto* run = std::get_if<protocol::RunStatus>(&message)) {
    // Results wait behind a switch that is due.
    const std::int64_t known = num_applied_[static_cast<std::size_t>(run->run)];
    const bool waits = core_.runs()[static_cast<std::size_t>(run->run)].is_at_switch();
    observer_.require(waits ? run->num_applied <= known : run->num_applied == known, rule);
  } else if (const auto* learner = std::get_if<protocol::LearnerStatus>(&message)) {
    const auto known = std::accumulate(num_applied_.begin(), num_applied_.end(), std::int64_t{0});
    observer_.require(
        waits_for_a_switch() ? learner->num_applied <= known : learner->num_applied == known, rule);
  }
}

bool SimulatedLearner::waits_for_a_switch() const {
  return std::ranges::any_of(core_.runs(),
                             [](const learner::Run& run) { return run.is_at_switch(); });
}

void SimulatedLearner::check_counters() {
  const LedgerCounters counters = core_.counters();
  const auto applied = std::accumulate(num_applied_.begin(), num_applied_.end(), std::int64_t{0});
  // After a failure or the end, and within recovery, nothing is drawn any more.
  const bool waits = waits_for_a_switch();  // results behind a switch that is due
  observer_.require(waits ? counters.applied <= applied : counters.applied == applied,
                    "applied results are not what the journal has");
  observer_.require(counters.issued == counters.applied + counters.pending,
                    "issued is not applied and pending");
  observer_.require(counters.pending >= 0 && counters.pending <= num_in_flight(study_),
                    "more is pending than may be in flight");
  observer_.require(waits ? counters.failed <= num_failed_ : counters.failed == num_failed_,
                    "failed results are not those applied");
  observer_.require(scenario_.liar >= 0 || (counters.rejected == 0 && counters.conflicting == 0),
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
    const bool reads = lag() < scenario_.unsynced_results_max && has_described(batch->worker_id);
    heard.surely_read.take(*batch, reads);
  } else if (const auto* request = std::get_if<protocol::DefinitionRequest>(&message)) {
    if (request->learner_id == id_) heard_[request->worker_id].time = schedule_.now();
  } else if (const auto* report = std::get_if<protocol::DefinitionReport>(&message)) {
    if (report->learner_id == id_) heard_[report->worker_id].time = schedule_.now();
  }
}

/// Who has not said what the task is, where nobody knew it beforehand, waits to be read.
bool SimulatedLearner::has_described(protocol::WorkerId id) const {
  const auto& workers = core_.workforce().workers().all();
  const auto found = workers.find(id);
  return scenario_.knows_task || (found != workers.end() && !found->second.described.empty());
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
