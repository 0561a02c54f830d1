// The rules of lcmtypes/PROTOCOL.md, numbered as there, tried on workers that may be anybody's.
#include <gmock/gmock.h>

#include <csignal>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "common/protocol/pieces.h"
#include "common/task_facts/task_description.h"
#include "common/transport/codec.h"
#include "tests/transport/loopback.h"
#include "tests/worker_app/learner_stand_in.h"

namespace treeroll::worker {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using ::testing::IsEmpty;

std::string from_environment(const char* name, const std::string& otherwise) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : otherwise;
}

/// The commands of the workers that are tried, with {url} for the network's.
std::vector<std::string> commands() {
  const std::string foreign = from_environment("TREEROLL_FOREIGN_WORKER", "");
  if (!foreign.empty()) return {foreign};
  return {TREEROLL_PYTHON_WORKER, TREEROLL_OUR_WORKER};
}

std::string task() {
  return from_environment("TREEROLL_FOREIGN_TASK",
                          R"({"name": "pendulum", "settings": {"duration_s": 0.5}})");
}

class ForeignWorkerTest : public testing::TestWithParam<std::string> {
 protected:
  static void SetUpTestSuite() {
    setenv("PYTHONPATH", TREEROLL_PYTHON_PACKAGE, 1);
    setenv("TREEROLL_POLICY_LIBRARY", TREEROLL_POLICY_LIBRARY, 1);
  }
  ForeignWorkerTest() : learner(100 + next_salt_++) {}

  void start() {
    std::string command = GetParam();
    command.replace(command.find("{url}"), 5, "'" + learner.url() + "'");
    worker.emplace(std::vector<std::string>{"-c", "exec " + command}, "", "/bin/sh");
    ASSERT_TRUE(learner.meet_worker()) << worker->errors();
  }
  /// Asks again and again, as a learner does, until all are answered.
  bool answers(int first, int num) {
    const auto all = [&] {
      for (int i = first; i < first + num; ++i) {
        if (learner.result(i) == nullptr) return false;
      }
      return true;
    };
    for (int i = 0; i < 20 && !all(); ++i) {
      learner.ask(first, num);
      learner.until(all, 1s);
    }
    return all();
  }
  /// How often the answer to this roll-out has come.
  int times_answered(int number) const {
    int times = 0;
    for (const auto& batch : learner.rewards) {
      for (const auto& result : batch.results) times += result.key.number == number ? 1 : 0;
    }
    return times;
  }

  static inline int next_salt_ = 0;
  LearnerStandIn learner;
  std::optional<Child> worker;
};

INSTANTIATE_TEST_SUITE_P(Workers, ForeignWorkerTest, testing::ValuesIn(commands()));

TEST_P(ForeignWorkerTest, Rules1And6And22NamesItselfAndIsHeardAgain) {
  start();
  EXPECT_GT(learner.status->worker_id, 0);
  EXPECT_FALSE(learner.status->numeric_class.empty());
  EXPECT_GE(learner.status->num_evaluators, 1);
  for (int i = 0; i < 3; ++i) {
    learner.status.reset();
    EXPECT_TRUE(learner.until([&] { return learner.status.has_value(); }, 2s)) << i;
  }
}

TEST_P(ForeignWorkerTest, Rule8AnswersAGreetingByNamingItsBatch) {
  start();
  learner.acknowledge();
  EXPECT_TRUE(learner.until([&] {
    const auto& held = learner.status->held;
    return held.size() == 1 && held[0].last_batch == 1 && held[0].keys.empty();
  }));
}

TEST_P(ForeignWorkerTest, Rules11To13EchoesTheQuestionAndCountsItsAnswers) {
  start();
  learner.define(task());
  ASSERT_TRUE(answers(0, 10)) << worker->errors();
  std::map<std::int64_t, int> by_index;
  for (const protocol::RewardBatch& batch : learner.rewards) {
    std::int64_t index = batch.first_index;
    EXPECT_LE(batch.oldest_index, batch.first_index);
    for (const protocol::RolloutResult& result : batch.results) {
      const auto [known, is_new] = by_index.emplace(index++, result.key.number);
      EXPECT_EQ(known->second, result.key.number) << "one index, one answer";
      EXPECT_EQ(result.content, 1000 + result.key.number);
      EXPECT_EQ(result.key.run, 0);
      EXPECT_EQ(result.outcome.status(), RolloutStatus::kOk) << result.outcome.reason();
    }
  }
  ASSERT_GE(by_index.size(), 10);
  EXPECT_EQ(by_index.begin()->first, 1);
  EXPECT_EQ(by_index.rbegin()->first, static_cast<std::int64_t>(by_index.size()));
}

TEST_P(ForeignWorkerTest, Rules17To19And21AsksForWhatItLacksAndReportsIt) {
  learner.define(task());  // before there is a worker
  start();
  learner.ask(0, 1);
  ASSERT_TRUE(learner.until([&] { return !learner.requests.empty(); }));
  std::set<protocol::DefinitionName> wanted;
  for (const auto& one : learner.requests[0].definitions) wanted.insert(one.name);
  EXPECT_EQ(wanted.size(), 2);
  // A content that is not what its name says is never used.
  const ContentHash id = content_hash(task());
  learner.send(protocol::DefinitionPiece{.learner_id = 4711,
                                         .name = {protocol::DefinitionKind::kTask, id},
                                         .num_bytes = 2,
                                         .index = 0,
                                         .bytes = "{}"});
  learner.define(task());
  ASSERT_TRUE(learner.until([&] { return learner.result(0) != nullptr; })) << worker->errors();
  bool described = false;
  for (const protocol::DefinitionReport& report : learner.reports) {
    EXPECT_TRUE(report.accepted) << report.text;
    if (report.definition_id != id) continue;
    described = true;
    EXPECT_LE(report.text.size(), kTaskReportBytesMax);
    const Result<TaskDescription> task = task_description_from_json(report.text);
    ASSERT_TRUE(task) << task.error().message;
    EXPECT_EQ(task->input_dim, 1) << report.text;
  }
  EXPECT_TRUE(described);
}

TEST_P(ForeignWorkerTest, Rule21RefusesATaskThatItDoesNotKnowAndOneOfOtherSettings) {
  start();
  learner.define(R"({"name": "nobody has this", "settings": {}})");
  const auto refused = [&] {
    return std::ranges::any_of(learner.reports, [](const auto& report) {
      return !report.accepted && !report.text.empty();
    });
  };
  EXPECT_TRUE(learner.until(refused));
  learner.reports.clear();
  json other = json::parse(task());
  other["described"] = {{"input_dim", 1},      {"output_dim", 1},     {"reward_min", 0},
                        {"reward_max", 12345}, {"time_limit_s", 0.5}, {"deterministic", true}};
  learner.define(other.dump());
  EXPECT_TRUE(learner.until(refused));
}

TEST_P(ForeignWorkerTest, Rule21SaysAgainWhatATaskIsThatComesAgain) {
  start();
  for (int time = 0; time < 2; ++time) {
    learner.reports.clear();
    learner.define(task());
    EXPECT_TRUE(learner.until([&] {
      return std::ranges::any_of(learner.reports,
                                 [](const auto& report) { return report.accepted; });
    })) << "time "
        << time;
  }
}

TEST_P(ForeignWorkerTest, Rule15And16RepeatsWhatIsNotSeenAndNothingThatIsSettled) {
  start();
  learner.define(task());
  ASSERT_TRUE(answers(0, 1)) << worker->errors();
  EXPECT_TRUE(learner.until([&] { return times_answered(0) >= 4; })) << "repeated till it is seen";
  learner.acknowledge();
  learner.until([] { return false; }, 300ms);  // what was on its way
  const int times = times_answered(0);
  learner.until([] { return false; }, 2500ms);  // longer than the longest pause
  EXPECT_EQ(times_answered(0), times);
}

TEST_P(ForeignWorkerTest, Rule14ARepeatedQuestionGetsTheSameAnswer) {
  start();
  learner.define(task());
  ASSERT_TRUE(answers(3, 1)) << worker->errors();
  learner.ask(3, 1);
  learner.until([] { return false; }, 500ms);
  std::set<std::int64_t> indices;
  for (const protocol::RewardBatch& batch : learner.rewards) {
    for (std::size_t i = 0; i < batch.results.size(); ++i) {
      if (batch.results[i].key.number == 3) {
        indices.insert(batch.first_index + static_cast<std::int64_t>(i));
      }
    }
  }
  EXPECT_EQ(indices.size(), 1) << "it was simulated again";
}

TEST_P(ForeignWorkerTest, Rule10SaysWhichBatchesHaveCome) {
  start();
  learner.define(task());
  ASSERT_TRUE(answers(0, 1)) << worker->errors();
  learner.acknowledge();
  learner.skip_batches(3);
  ASSERT_TRUE(answers(1, 1));
  const protocol::RewardBatch& last = learner.rewards.back();
  const auto bits = static_cast<std::uint64_t>(last.batches_received);
  EXPECT_EQ(bits & 1U, 1U) << "the last has come";
  const auto lost = [&](std::int64_t sequence) {
    return (bits >> static_cast<unsigned>(last.last_batch - sequence) & 1U) == 0;
  };
  for (const std::int64_t sequence : learner.skipped) EXPECT_TRUE(lost(sequence)) << sequence;
}

TEST_P(ForeignWorkerTest, Rule4And5BearsAnyBytesAndIgnoresWhatIsNotForIt) {
  start();
  learner.define(task());
  for (const char* channel :
       {"TREEROLL_ROLLOUTS", "TREEROLL_DEFINITIONS", "TREEROLL_LEARNER", "ANY"}) {
    for (const std::size_t size : {0U, 7U, 8U, 100U, 5000U}) {
      transport::send_datagram(learner.url(),
                               transport::short_message(channel, std::string(size, '\x7f')));
    }
  }
  // A message that is whole but for its end, and one with a count that has no room.
  const std::vector<std::byte> whole = transport::encode(
      protocol::Message(protocol::RolloutBatch{4711, 1, {}, {{learner.status->worker_id, 0, 0}}}));
  std::string text(reinterpret_cast<const char*>(whole.data()), whole.size());
  transport::send_datagram(learner.url(),
                           transport::short_message("TREEROLL_ROLLOUTS", text.substr(0, 40)));
  text[24] = '\x7f';
  transport::send_datagram(learner.url(), transport::short_message("TREEROLL_ROLLOUTS", text));
  const protocol::WorkerId mine = learner.status->worker_id;
  learner.status->worker_id = mine == 1 ? 2 : 1;
  learner.ask(50, 1);  // of another worker
  learner.status->worker_id = mine;
  ASSERT_TRUE(answers(0, 2)) << worker->errors();
  EXPECT_EQ(learner.result(50), nullptr);
}

TEST_P(ForeignWorkerTest, Rule17TakesAThetaInPieces) {
  start();
  learner.define(task());
  ASSERT_TRUE(answers(2, 1)) << worker->errors();
  const std::string theta = protocol::content_of_theta({1, 1, .1 * 2});
  learner.rewards.clear();
  const auto answered = [&] { return learner.result(7) != nullptr; };
  for (int i = 0; i < 20 && !answered(); ++i) {
    learner.ask_with_theta(7, content_hash(theta));
    learner.until([] { return false; }, 20ms);
    learner.send(protocol::definition_piece(
        4711, {protocol::DefinitionKind::kTheta, content_hash(theta)}, theta, 0));
    learner.until(answered, 1s);
  }
  ASSERT_TRUE(answered());
  const double reward = learner.result(7)->outcome.reward();
  learner.rewards.clear();
  ASSERT_TRUE(answers(2, 1));
  EXPECT_EQ(reward, learner.result(2)->outcome.reward());
}

TEST_P(ForeignWorkerTest, Rules23And24DrainsAndSaysSo) {
  start();
  learner.define(task());
  ASSERT_TRUE(answers(0, 2)) << worker->errors();
  worker->signal(SIGTERM);
  EXPECT_TRUE(learner.until([&] { return learner.status->draining; }));
  EXPECT_EQ(learner.status->free_slots, 0);
  for (int i = 0; i < 20; ++i) {
    learner.acknowledge();
    if (worker->wait(200ms)) break;
  }
  EXPECT_EQ(worker->wait(1ms), 0);
}

}  // namespace
}  // namespace treeroll::worker
