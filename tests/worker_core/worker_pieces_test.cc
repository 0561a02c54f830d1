// Definitions and thetas of many pieces, of which some are lost.
#include <gmock/gmock.h>

#include <cmath>

#include "common/protocol/wire_sizes.h"
#include "tests/worker_core/stage.h"

namespace treeroll::worker {
namespace {

using protocol::DefinitionReport;
using protocol::DefinitionRequest;
using protocol::kPieceBytes;
using protocol::WantedDefinition;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const std::string kLongPolicy(5 * kPieceBytes + 7, 'p');

MessageReceived piece(const std::string& content, int index,
                      DefinitionKind kind = DefinitionKind::kPolicy) {
  return {protocol::definition_piece(kLearner, {kind, content_hash(content)}, content, index)};
}

protocol::RolloutRequest long_request(Stage& stage, int number) {
  protocol::RolloutRequest request = stage.request(number);
  request.policy_id = content_hash(kLongPolicy);
  return request;
}

TEST(WorkerPiecesTest, AsksForTheMissingPiecesUntilTheyAreThere) {
  Stage stage;
  stage.define();
  stage.clear();
  for (const int index : {0, 3, 5}) stage.step(piece(kLongPolicy, index));
  stage.ask({long_request(stage, 1)});
  const WantedDefinition missing{policy_name(kLongPolicy), {1, 2, 4}};
  ASSERT_THAT(stage.sent<DefinitionRequest>(), SizeIs(1));
  EXPECT_THAT(stage.sent<DefinitionRequest>()[0].definitions, ElementsAre(missing));
  stage.step(piece(kLongPolicy, 2));
  stage.clear();
  stage.pass(5ms);
  const WantedDefinition fewer{policy_name(kLongPolicy), {1, 4}};
  ASSERT_THAT(stage.sent<DefinitionRequest>(), SizeIs(1));
  EXPECT_THAT(stage.sent<DefinitionRequest>()[0].definitions, ElementsAre(fewer));
  for (const int index : {1, 4}) stage.step(piece(kLongPolicy, index));
  EXPECT_EQ(stage.running(0).key.number, 1);
  EXPECT_EQ(stage.effects<LoadDefinition>().at(0).content, kLongPolicy);
}

TEST(WorkerPiecesTest, AskingKeepsToAFrameHoweverMuchIsMissing) {
  Stage stage(1, [](WorkerSettings& s) { s.batch_bytes_max = protocol::kBatchBytesRemoteMax; });
  const std::string largest(protocol::kDefinitionBytesMax, 'x');
  stage.step(piece(largest, 5));
  protocol::RolloutRequest request = stage.request(1);
  request.policy_id = content_hash(largest);
  stage.ask({request});
  const auto requests = stage.sent<DefinitionRequest>();
  std::set<int> asked;
  for (const DefinitionRequest& one : requests) {
    std::size_t bytes = protocol::kFrameBytesMax + protocol::kDefinitionRequestBytes;
    for (const WantedDefinition& wanted : one.definitions) {
      bytes += protocol::wanted_definition_bytes(wanted.pieces.size());
      asked.insert(wanted.pieces.begin(), wanted.pieces.end());
    }
    EXPECT_LE(bytes, protocol::kBatchBytesRemoteMax);
  }
  EXPECT_THAT(asked, SizeIs(protocol::kPiecesMax - 1)) << "all but the one that has come";
}

TEST(WorkerPiecesTest, SaysOnceThatItKnowsADefinitionThatComesAgain) {
  Stage stage;
  const auto task_piece = [](int index) {
    return MessageReceived{
        protocol::definition_piece(kLearner, task_name(kLongPolicy), kLongPolicy, index)};
  };
  for (int index = 0; index < 6; ++index) stage.step(task_piece(index));
  EXPECT_THAT(stage.sent<DefinitionReport>(), SizeIs(1));
  stage.clear();
  for (int index = 0; index < 6; ++index) stage.step(task_piece(index));
  EXPECT_THAT(stage.sent<DefinitionReport>(), SizeIs(1));
  EXPECT_THAT(stage.effects<LoadDefinition>(), IsEmpty());
}

TEST(WorkerPiecesTest, AForgedPieceCostsOneMoreRound) {
  Stage stage;
  stage.define();
  stage.ask({long_request(stage, 1)});
  auto forged = std::get<protocol::DefinitionPiece>(piece(kLongPolicy, 0).message);
  forged.bytes[0] = 'q';
  stage.step(MessageReceived{forged});
  for (int index = 1; index < 6; ++index) stage.step(piece(kLongPolicy, index));
  EXPECT_THAT(stage.runs(), IsEmpty());
  EXPECT_EQ(stage.status().num_rejected, 1);
  stage.clear();
  stage.pass(50ms);
  EXPECT_THAT(stage.sent<DefinitionRequest>().at(0).definitions,
              ElementsAre(WantedDefinition{policy_name(kLongPolicy), {}}));
  for (int index = 0; index < 6; ++index) stage.step(piece(kLongPolicy, index));
  EXPECT_EQ(stage.running(0).key.number, 1);
}

class WorkerThetaTest : public ::testing::Test {
 protected:
  WorkerThetaTest() : theta_(300, .25), content_(protocol::content_of_theta(theta_)) {
    stage_.policy_facts.theta_dim = 300;
    stage_.define();
    stage_.clear();
  }

  protocol::RolloutRequest request(int number) {
    protocol::RolloutRequest request = stage_.request(number);
    request.theta.clear();
    request.theta_id = content_hash(content_);
    return request;
  }
  MessageReceived theta_piece(int index) const {
    return piece(content_, index, DefinitionKind::kTheta);
  }

  Stage stage_;
  std::vector<double> theta_;
  std::string content_;
};

TEST_F(WorkerThetaTest, ARolloutWaitsForAThetaThatComesInPieces) {
  stage_.ask({request(1), request(2)});
  EXPECT_THAT(stage_.runs(), IsEmpty());
  const DefinitionName name{DefinitionKind::kTheta, content_hash(content_)};
  EXPECT_THAT(stage_.sent<DefinitionRequest>().at(0).definitions,
              ElementsAre(WantedDefinition{name, {}}));
  for (const int index : {2, 0, 1}) stage_.step(theta_piece(index));
  EXPECT_EQ(stage_.running(0).theta, theta_);
  stage_.finish(0);
  EXPECT_EQ(stage_.running(0).key.number, 2) << "both have it";
  EXPECT_EQ(stage_.running(0).theta, theta_);
  stage_.clear();
  stage_.pass(1s);
  EXPECT_THAT(stage_.sent<DefinitionRequest>(), IsEmpty());
}

TEST_F(WorkerThetaTest, OfOthersRolloutsIsNotKept) {
  for (int index = 0; index < 3; ++index) stage_.step(theta_piece(index));
  stage_.ask({request(1)});
  EXPECT_THAT(stage_.runs(), IsEmpty());
  EXPECT_THAT(stage_.sent<DefinitionRequest>().at(0).definitions.at(0).pieces, IsEmpty());
}

TEST_F(WorkerThetaTest, ThatDoesNotComeIsLetGoAfterThirtySeconds) {
  stage_.ask({request(1)});
  stage_.step(theta_piece(1));
  stage_.pass_heard(31s);
  EXPECT_THAT(stage_.status().held.at(0).keys, IsEmpty());
  bool said = false;
  for (const LogLine& line : stage_.effects<LogLine>()) {
    said = said || line.text.find("its theta did not come in 30 s") != std::string::npos;
  }
  EXPECT_TRUE(said);
}

TEST_F(WorkerThetaTest, OfNoNumbersIsRefusedWithItsRollouts) {
  theta_[7] = std::nan("");
  content_ = protocol::content_of_theta(theta_);
  stage_.ask({request(1)});
  for (int index = 0; index < 3; ++index) stage_.step(theta_piece(index));
  EXPECT_THAT(stage_.runs(), IsEmpty());
  EXPECT_EQ(stage_.status().num_rejected, 1);
  EXPECT_THAT(stage_.status().held.at(0).keys, IsEmpty());
}

/// What a worker holds is named in slices where a frame has no room for all.
TEST(WorkerPiecesTest, NamesAllThatItHoldsInFrames) {
  Stage stage(20, [](WorkerSettings& s) { s.batch_bytes_max = protocol::kBatchBytesRemoteMax; });
  stage.define();
  stage.ask_for(500);
  stage.clear();
  stage.pass(100ms);
  const auto statuses = stage.sent<protocol::WorkerStatus>();
  EXPECT_GT(statuses.size(), 3U);
  std::vector<protocol::RolloutKey> named;
  protocol::RolloutKey first = protocol::kFirstKey;
  for (const protocol::WorkerStatus& status : statuses) {
    ASSERT_THAT(status.held, SizeIs(1));
    const protocol::HeldRollouts& held = status.held[0];
    EXPECT_LE(protocol::kFrameBytesMax + protocol::kWorkerStatusBytes +
                  protocol::kHeldRolloutsBytes + 8 * held.keys.size(),
              protocol::kBatchBytesRemoteMax);
    EXPECT_EQ(held.first, first);
    if (held.last != protocol::kLastKey) first = {held.last.run, held.last.number + 1};
    named.insert(named.end(), held.keys.begin(), held.keys.end());
    EXPECT_EQ(held.last == protocol::kLastKey, &status == &statuses.back());
  }
  EXPECT_THAT(named, SizeIs(500));
}

}  // namespace
}  // namespace treeroll::worker
