#include "workers/relay/rack.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <variant>
#include <vector>

#include "common/protocol/pieces.h"
#include "tests/learner_core/fake_worker.h"

namespace treeroll::relay {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr protocol::LearnerId kServed = 1;

/// A rack with one worker below, and what the core above would do with it, by hand.
class RackTest : public ::testing::Test {
 protected:
  RackTest() {
    for (const auto& [kind, content] : {std::pair(protocol::DefinitionKind::kTask, task_),
                                        std::pair(protocol::DefinitionKind::kPolicy, policy_)}) {
      const protocol::DefinitionName name{kind, content_hash(content)};
      shelf_.receive(turn(), protocol::definition_piece(kServed, name, content, 0), {});
    }
  }

  static worker::RolloutName name(int number) { return {kServed, {.run = 0, .number = number}}; }

  /// Roll-outs with these numbers go down, until the worker has them.
  void evaluate(const std::vector<int>& numbers) {
    std::vector<worker::Work> works;
    for (const int number : numbers) {
      works.push_back({name(number),
                       {.key = name(number).key,
                        .content = 100 + number,
                        .task_id = content_hash(task_),
                        .policy_id = content_hash(policy_),
                        .theta = {.1 * number, 0}},
                       {}});
    }
    const auto num_requests = worker_.num_requests + std::ssize(numbers);
    rack_.evaluate(turn(), 0, std::move(works), shelf_);
    for (int i = 0; i < 100 && worker_.num_requests < num_requests; ++i) {
      now_ += 10ms;
      hear(worker_.status(below_));
    }
    ASSERT_EQ(worker_.num_requests, num_requests);
  }

  /// The next roll-out's answer comes up to the rack.
  void answer() { hear(worker_.finish(below_, now_)); }

  /// What the core above is told of when it asks next.
  std::vector<worker::RolloutName> answered() {
    std::vector<worker::RolloutName> names;
    for (const worker::WorkEnd& end : rack_.on(turn(), worker::EvaluatorReady{}, shelf_)) {
      names.push_back(std::get<worker::WorkAnswered>(end).name);
    }
    return names;
  }

  Rack rack_{{.relay_id = 500, .batch_bytes_max = 60'000}};

 private:
  worker::Turn turn() { return {now_, effects_, log_limiter_}; }

  void hear(const protocol::Message& message) {
    rack_.receive(now_, message);
    rack_.dispatch(now_);
    for (const learner::Effect& effect : rack_.take_effects()) {
      const auto* send = std::get_if<learner::SendMessage>(&effect);
      if (send == nullptr) continue;
      if (const auto* batch = std::get_if<protocol::RolloutBatch>(&send->message)) {
        below_ = batch->learner_id;
      }
      for (const protocol::Message& reply : worker_.receive(send->message, now_)) hear(reply);
    }
  }

  const std::string task_ = R"({"name":"bump","settings":{}})";
  const std::string policy_ = "a policy";
  const worker::WorkerSettings settings_;
  worker::DefinitionShelf shelf_{settings_};
  worker::Effects effects_;
  LogLimiter log_limiter_;
  learner::FakeWorker worker_{1, 10ms};
  protocol::LearnerId below_ = 0;  ///< the learner's name below
  TimePoint now_{1h};
};

TEST_F(RackTest, TheAnswerToAQuestionThatIsWithdrawnBeforeItIsTakenUpIsNotGiven) {
  evaluate({0, 1});
  answer();
  answer();
  ASSERT_TRUE(rack_.has_news());
  rack_.withdraw(name(0));
  EXPECT_THAT(answered(), ElementsAre(name(1))) << "and the other one is";
}

TEST_F(RackTest, TheAnswerThatComesAfterItsQuestionIsWithdrawnIsNotGiven) {
  evaluate({0, 1});
  rack_.withdraw(name(0));
  answer();
  EXPECT_THAT(answered(), IsEmpty());
  answer();
  EXPECT_THAT(answered(), ElementsAre(name(1)));
}

TEST_F(RackTest, AWithdrawnQuestionMayBeAskedAgainAndIsAnsweredOnce) {
  evaluate({0});
  answer();
  rack_.withdraw(name(0));
  evaluate({0});
  answer();
  EXPECT_THAT(answered(), ElementsAre(name(0)));
  EXPECT_THAT(answered(), IsEmpty());
}

}  // namespace
}  // namespace treeroll::relay
