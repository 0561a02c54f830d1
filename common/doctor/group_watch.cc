#include "common/doctor/group_watch.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/protocol/limits.h"
#include "common/protocol/wire_sizes.h"

namespace treeroll::doctor {
namespace {

/// More workers than these are counted, those in trouble named all the same.
constexpr std::size_t kNamedWorkersMax = 16;
/// A worker sends several heartbeats a second: who was heard so often had time to answer.
constexpr int kHeartbeatsToAnswer = 4;

std::string where(const std::string& host, std::int32_t pid) {
  return fmt::format("{}:{}", host, pid);
}

/// Words to workers that one batch holds, and the bytes it has with so many.
std::size_t num_words_max(const GroupWatch::Settings& settings) {
  const std::size_t room =
      settings.batch_bytes_max - protocol::kFrameBytesMax - protocol::kRolloutBatchBytes;
  return std::min<std::size_t>(room / (protocol::kAcknowledgementBytes + settings.word_bytes),
                               protocol::kAcknowledgementsPerBatchMax);
}

std::size_t bytes_of(std::size_t num_words, const GroupWatch::Settings& settings) {
  return protocol::kRolloutBatchBytes +
         num_words * (protocol::kAcknowledgementBytes + settings.word_bytes);
}

std::string plural(std::int64_t count, const char* one) {
  return fmt::format("{} {}{}", count, one, count == 1 ? "" : "s");
}

}  // namespace

GroupWatch::GroupWatch(Settings settings) : settings_(std::move(settings)) {}

protocol::RolloutBatch GroupWatch::next_batch(TimePoint now) {
  sent_[++last_sequence_] = now;
  return {.learner_id = settings_.id,
          .sequence = last_sequence_,
          .rollouts = {},
          .acknowledgements = {}};
}

protocol::RolloutBatch GroupWatch::greeting(TimePoint now) {
  protocol::RolloutBatch batch = next_batch(now);
  const std::size_t count_max = num_words_max(settings_);
  auto next = workers_.upper_bound(last_greeted_);
  for (std::size_t i = 0; i < workers_.size(); ++i, ++next) {
    if (next == workers_.end()) next = workers_.begin();
    if (next->second.hears_us || next->second.proof.is_unchecked) continue;
    if (batch.acknowledgements.size() == count_max) break;
    last_greeted_ = next->first;
    next->second.was_greeted = true;
    batch.acknowledgements.push_back(
        {.worker_id = next->first, .seen_index = 0, .result_index = 0});
  }
  return batch;
}

protocol::RolloutBatch GroupWatch::longest_batch(TimePoint now) {
  protocol::RolloutBatch batch = next_batch(now);
  const std::size_t count = num_words_max(settings_);
  // Workers draw their names among 2^63: none has these.
  for (std::size_t i = 1; i <= count; ++i) {
    batch.acknowledgements.push_back(
        {.worker_id = static_cast<std::int64_t>(i), .seen_index = 0, .result_index = 0});
  }
  long_ones_.insert(batch.sequence);
  return batch;
}

void GroupWatch::take(TimePoint now, const protocol::Message& message, const Proof& proof) {
  if (const auto* batch = std::get_if<protocol::RolloutBatch>(&message)) {
    const auto ours = batch->learner_id == settings_.id ? sent_.find(batch->sequence) : sent_.end();
    if (ours == sent_.end()) return;
    if (long_ones_.contains(batch->sequence)) {
      long_came_back_ = true;
    } else {
      short_came_back_ = true;
      fastest_echo_ = std::min(fastest_echo_, now - ours->second);
    }
    sent_.erase(ours);
  } else if (const auto* learner = std::get_if<protocol::LearnerStatus>(&message)) {
    if (learners_.size() < protocol::kLearnersPerWorkerMax ||
        learners_.contains(learner->learner_id)) {
      learners_[learner->learner_id] = {*learner, proof};
    }
  } else if (const auto* status = std::get_if<protocol::WorkerStatus>(&message)) {
    if (workers_.size() >= protocol::kWorkersMax && !workers_.contains(status->worker_id)) return;
    Worker& worker = workers_[status->worker_id];
    worker.status = *status;
    worker.proof = proof;
    if (worker.was_greeted) ++worker.num_heard;
    for (const protocol::HeldRollouts& held : status->held) {
      if (held.learner_id == settings_.id && held.last_batch > 0) worker.hears_us = true;
    }
  }
}

Findings GroupWatch::findings() const {
  Findings findings;
  say_echoes(findings);
  say_learners(findings);
  say_workers(findings);
  say_classes(findings);
  return findings;
}

void GroupWatch::say_echoes(Findings& findings) const {
  if (short_came_back_) {
    findings.push_back({Level::kOk, "echo",
                        fmt::format("our messages come back, the fastest after {:.1f} ms",
                                    to_seconds(fastest_echo_) * 1e3)});
  } else {
    findings.push_back({Level::kTrouble, "echo",
                        fmt::format("of {} that were sent to {} none came back to this host",
                                    plural(last_sequence_, "message"), settings_.group),
                        "let a firewall on this host pass them, in and out (`nft list ruleset` or "
                        "`iptables -L` shows it)"});
    return;
  }
  const std::size_t longest = bytes_of(num_words_max(settings_), settings_);
  if (!long_ones_.empty() && !long_came_back_) {
    findings.push_back({Level::kTrouble, "length",
                        fmt::format("short messages come back, those of {} bytes do not", longest),
                        "raise the MTU of the interface that the group leaves by to 1500 (`ip link "
                        "set INTERFACE mtu 1500`), or let a firewall pass fragments"});
  } else if (long_came_back_) {
    findings.push_back(
        {Level::kOk, "length", fmt::format("messages of {} bytes come back", longest)});
  }
}

void GroupWatch::say_learners(Findings& findings) const {
  if (learners_.empty()) {
    findings.push_back(
        {Level::kNotice, "learner", "none is heard",
         "treeroll-learner STUDY starts one; one on another host needs the same URL with ttl=1"});
  }
  for (const auto& [id, known] : learners_) {
    const protocol::LearnerStatus& learner = known.status;
    const std::string who =
        fmt::format("{}, study {}", where(learner.host, learner.pid), learner.study);
    const std::string progress = fmt::format(
        "{} of {} roll-outs, {} of {} runs done, {}", learner.num_applied, learner.num_rollouts,
        learner.num_runs_done, learner.num_runs, plural(learner.num_workers, "worker"));
    if (learner.waiting_for.empty()) {
      findings.push_back({Level::kOk, "learner", fmt::format("{}: {}", who, progress)});
    } else {
      findings.push_back({Level::kTrouble, "learner",
                          fmt::format("{}: {}; it waits: {}", who, progress, learner.waiting_for),
                          "the lines of workers below say more"});
    }
    if (known.proof.refusal) {
      findings.push_back(
          {Level::kTrouble, "learner",
           fmt::format("{}: a worker with this key refuses it: {}", who, *known.proof.refusal),
           "make this host's key of that learner's: treeroll-keygen NEW.key --worker-of "
           "LEARNER.key"});
    }
    if (!learner.last_failure.empty()) {
      findings.push_back({Level::kNotice, "learner",
                          fmt::format("{}: {} failed, the last: {}", who,
                                      plural(learner.num_failed, "roll-out"), learner.last_failure),
                          "treeroll-replay DIR --export csv lists them with their reasons"});
    }
    if (learner.num_conflicting > 0) {
      findings.push_back(
          {Level::kTrouble, "learner",
           fmt::format("{}: {} of workers of one numeric class differ in their reward", who,
                       plural(learner.num_conflicting, "answer")),
           "workers of one class run different programs or a task that is not deterministic says "
           "it is"});
    }
  }
}

void GroupWatch::say_workers(Findings& findings) const {
  if (workers_.empty()) {
    findings.push_back({Level::kNotice, "worker", "none is heard",
                        "treeroll-worker --lcm-url URL starts one; one on another host needs the "
                        "same URL with ttl=1"});
    return;
  }
  std::int64_t num_evaluators = 0;
  std::size_t num_well = 0;
  std::int64_t num_untried = 0;
  for (const auto& [id, worker] : workers_) {
    const protocol::WorkerStatus& status = worker.status;
    num_evaluators += status.num_evaluators;
    const std::string who = fmt::format("{} ({}, {})", where(status.host, status.pid),
                                        plural(status.num_evaluators, "evaluator"), status.version);
    bool is_well = true;
    const auto say = [&](Level level, const std::string& what, const std::string& cure) {
      findings.push_back({level, "worker", who + ": " + what, cure});
      is_well = false;
    };
    if (worker.proof.is_unchecked) {
      ++num_untried;
    } else if (!worker.hears_us && worker.num_heard >= kHeartbeatsToAnswer) {
      say(Level::kTrouble, "is heard and does not hear this host",
          fmt::format("on its host let {} in from this one; treeroll-doctor there shows more",
                      settings_.group));
    } else if (!worker.hears_us) {
      say(Level::kNotice, "was heard too seldom to tell whether it hears this host",
          "ask again with more --seconds");
    }
    if (status.version != settings_.version) {
      say(Level::kTrouble,
          fmt::format("speaks another version than this program, {}", settings_.version),
          "run one version of treeroll on all hosts");
    }
    if (status.num_restarts > 0) {
      say(Level::kNotice, fmt::format("has restarted evaluators {} times", status.num_restarts),
          "its log says why: a task that crashes, or one past its time or memory");
    }
    // Among what such a worker refuses is what we say.
    if (status.num_rejected > 0 && !worker.proof.is_unchecked) {
      say(Level::kNotice, fmt::format("has refused {}", plural(status.num_rejected, "message")),
          "its log says why: other versions, or strangers on the group");
    }
    const bool holds_nothing =
        std::all_of(status.held.begin(), status.held.end(),
                    [](const protocol::HeldRollouts& held) { return held.keys.empty(); });
    if (status.num_evaluators > 0 && status.free_slots == 0 && !status.draining && holds_nothing) {
      say(Level::kTrouble, "holds nothing and has no room: no evaluator of it lives",
          "its log says why; one that has just started has room within seconds");
    }
    if (status.draining) say(Level::kNotice, "is about to end and takes no more roll-outs", "");
    if (!is_well) continue;
    if (++num_well > kNamedWorkersMax) continue;
    findings.push_back({Level::kOk, "worker",
                        who + (worker.proof.is_unchecked ? ": is heard, and signs what it says"
                                                         : ": hears this host and is heard")});
  }
  if (num_well > kNamedWorkersMax) {
    findings.push_back(
        {Level::kOk, "worker",
         fmt::format("and {} more of which the same is true", num_well - kNamedWorkersMax)});
  }
  if (num_untried > 0) {
    findings.push_back(
        {Level::kNotice, "worker",
         fmt::format("{} with keys: whether this host is heard there takes a learner's key to try",
                     plural(num_untried, "worker")),
         "on a learner's host, treeroll-doctor --key-file LEARNER.key tries it; a learner's key "
         "need not be on others"});
  }
  findings.push_back(
      {Level::kOk, "workers",
       fmt::format("{} with {}", plural(static_cast<std::int64_t>(workers_.size()), "worker"),
                   plural(num_evaluators, "evaluator"))});
}

void GroupWatch::say_classes(Findings& findings) const {
  std::map<std::string, int> classes;
  for (const auto& [id, worker] : workers_) ++classes[worker.status.numeric_class];
  if (classes.size() < 2) return;
  std::string list;
  for (const auto& [name, count] : classes)
    list += fmt::format("{}{} ({})", list.empty() ? "" : ", ", name, count);
  findings.push_back(
      {Level::kNotice, "classes",
       fmt::format("rewards of ODE's tasks differ in their last bits between numeric classes: {}",
                   list),
       "study.numeric_class = \"one\" keeps a study to one of them"});
}

}  // namespace treeroll::doctor
