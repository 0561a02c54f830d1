#include "tests/benchmarks/learner_loop.h"

#include <time.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "common/base/check.h"
#include "common/transport/codec.h"
#include "tests/benchmarks/shipped_study.h"

namespace treeroll::benchmarks {
namespace {

constexpr protocol::LearnerId kLearner = 77;
constexpr Duration kRolloutTime = std::chrono::microseconds(100);
/// Other programs of the machine do not count.
std::chrono::nanoseconds processor_time() {
  timespec now{};
  CHECK(clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now) == 0, "no clock of processor time");
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

learner::LearnerSettings settings_for(const Study& study) {
  learner::LearnerSettings settings;
  settings.learner_id = kLearner;
  settings.batch_bytes_max = protocol::kBatchBytesLocalMax;
  for (const Condition& condition : study.conditions) {
    settings.known_tasks[condition.task_content] = task_of(condition)->description();
  }
  return settings;
}

}  // namespace

ContentHash LearnerLoop::study_id() { return content_hash("a benchmark"); }

LearnerLoop::LearnerLoop(const Study& study, const Traffic& traffic,
                         const std::filesystem::path& journal)
    : traffic_(traffic), journal_(journal), worker_(1, kRolloutTime) {
  learner::LearnerSettings settings = settings_for(study);
  journal_.append(JournalStart{.study_id = study_id(), .learner_id = kLearner}, 0);
  worker_.description = to_json(settings.known_tasks.begin()->second).dump();
  core_ = std::make_unique<learner::LearnerCore>(study, std::move(settings));
  step(learner::Started{});
  step(learner::RecoveryFinished{});
}

std::chrono::nanoseconds LearnerLoop::learn(std::int64_t num_results) {
  const std::int64_t end = num_results_ + num_results;
  std::chrono::nanoseconds spent{};
  int turns_without_result = 0;
  while (num_results_ < end) {
    const std::int64_t before = num_results_;
    std::vector<Encoded> messages;
    for (const protocol::Message& message : answers()) {
      messages.push_back({transport::channel_of(message), transport::encode(message)});
    }
    spent += take(messages);
    turns_without_result = num_results_ == before ? turns_without_result + 1 : 0;
    CHECK(turns_without_result < 10'000, "the learner and its workers go on");
    CHECK(core_->outcome() == learner::LearnerCore::Outcome::kRunning, core_->failure());
  }
  return spent;
}

std::vector<protocol::Message> LearnerLoop::answers() {
  std::vector<protocol::Message> answers;
  for (const Encoded& encoded : std::exchange(sent_, {})) {
    const auto message = transport::decode(encoded.channel, encoded.bytes);
    for (protocol::Message& reply : worker_.receive(*message, now_)) {
      answers.push_back(std::move(reply));
    }
  }
  if (now_ >= next_heartbeat_) {
    answers.emplace_back(worker_.status(kLearner));
    next_heartbeat_ = now_ + protocol::kBusyHeartbeat;
  }
  for (int number = 0; number < traffic_.messages_a_turn && worker_.has_work(); ++number) {
    protocol::RewardBatch batch;
    for (int i = 0; i < traffic_.results_a_message && worker_.has_work(); ++i) {
      batch = worker_.finish(kLearner, now_);
    }
    // Each result travels once: nothing is lost here.
    const auto known =
        static_cast<std::ptrdiff_t>(std::max<std::int64_t>(0, last_index_ + 1 - batch.first_index));
    batch.results.erase(batch.results.begin(), batch.results.begin() + known);
    batch.first_index += known;
    last_index_ = batch.first_index + static_cast<std::int64_t>(batch.results.size()) - 1;
    answers.emplace_back(std::move(batch));
  }
  return answers;
}

std::chrono::nanoseconds LearnerLoop::take(const std::vector<Encoded>& messages) {
  now_ += std::chrono::microseconds(200);
  const std::chrono::nanoseconds begin = processor_time();
  for (const Encoded& encoded : messages) {
    auto message = transport::decode(encoded.channel, encoded.bytes);
    step(learner::MessageReceived{std::move(*message)});
  }
  step(learner::SyncBegun{});
  step(learner::JournalSynced{});
  step(learner::InboxDrained{});
  if (core_->next_deadline() <= now_) step(learner::TimerFired{});
  return processor_time() - begin;
}

void LearnerLoop::step(const learner::Event& event) {
  learner::Effects effects;
  core_->step(now_, event, effects);
  learner::carry_out(effects, *this);
}

void LearnerLoop::append(const AcceptedResult& result) {
  journal_.append(result, 0);
  ++num_results_;
}

void LearnerLoop::append(const SecondAnswer& answer) { journal_.append(answer, 0); }

void LearnerLoop::append(const KnownWorker& worker) { journal_.append(worker, 0); }

void LearnerLoop::append(const TaskSignals& signals) { journal_.append(signals, 0); }

void LearnerLoop::append(const LearningTime& time) { journal_.append(time, 0); }

void LearnerLoop::send(const protocol::Message& message) {
  sent_.push_back({transport::channel_of(message), transport::encode(message)});
  ++num_messages_sent_;
  num_bytes_sent_ += static_cast<std::int64_t>(sent_.back().bytes.size());
}

void LearnerLoop::log(const LogLine& line) {
  CHECK(line.level == LogLine::Level::kInfo, line.text);
}

}  // namespace treeroll::benchmarks
