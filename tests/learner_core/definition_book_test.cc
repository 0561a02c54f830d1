#include "learner/core/definition_book.h"

#include <gtest/gtest.h>

#include <map>

#include "common/protocol/limits.h"
#include "common/protocol/timings.h"

namespace treeroll::learner {
namespace {

using protocol::DefinitionKind;
using protocol::DefinitionName;
using protocol::DefinitionPiece;
using protocol::kPieceBytes;
using std::chrono::milliseconds;
using std::chrono::seconds;

class DefinitionBookTest : public ::testing::Test {
 protected:
  DefinitionName add(const std::string& content) {
    return {DefinitionKind::kPolicy, book_.add(DefinitionKind::kPolicy, content)};
  }
  /// All that is due, burst after burst.
  std::vector<DefinitionPiece> take_all() {
    std::vector<DefinitionPiece> all;
    while (const auto next = book_.next_burst()) {
      now_ = std::max(now_, *next);
      for (DefinitionPiece& piece : book_.take_due(9, now_)) all.push_back(std::move(piece));
    }
    return all;
  }
  std::vector<int> indices(const std::vector<DefinitionPiece>& pieces) const {
    std::vector<int> found;
    for (const DefinitionPiece& piece : pieces) found.push_back(piece.index);
    return found;
  }

  DefinitionBook book_;
  TimePoint now_{seconds(100)};
};

TEST_F(DefinitionBookTest, PublishesAllPiecesInBurstsThatAReceiverHasRoomFor) {
  const std::string content(200 * kPieceBytes + 1, 'c');
  const DefinitionName name = add(content);
  EXPECT_FALSE(book_.next_burst());
  book_.publish(name, now_);
  std::string together;
  TimePoint last{};
  while (const auto next = book_.next_burst()) {
    now_ = std::max(now_, *next);
    const auto burst = book_.take_due(9, now_);
    EXPECT_LE(burst.size(), 64U);
    EXPECT_GE(now_, last + milliseconds(1)) << "with a pause between";
    last = now_;
    for (const DefinitionPiece& piece : burst) {
      EXPECT_EQ(piece.learner_id, 9);
      EXPECT_EQ(piece.name, name);
      together += piece.bytes;
    }
    EXPECT_TRUE(book_.take_due(9, now_).empty());
  }
  EXPECT_EQ(together, content);
}

TEST_F(DefinitionBookTest, SendsOnlyThePiecesThatAreWanted) {
  const DefinitionName name = add(std::string(20 * kPieceBytes, 'c'));
  book_.publish_wanted({name, {7, 3, 19}}, now_);
  EXPECT_EQ(indices(take_all()), (std::vector<int>{3, 7, 19}));
}

TEST_F(DefinitionBookTest, SendsAPieceOnceHoweverManyAskWithinThePause) {
  const DefinitionName name = add(std::string(20 * kPieceBytes, 'c'));
  for (int worker = 0; worker < 50; ++worker) book_.publish_wanted({name, {3, 4}}, now_);
  EXPECT_EQ(take_all().size(), 2U);
  const TimePoint sent_at = now_;
  now_ = sent_at + protocol::kPublicationPause - milliseconds(1);
  book_.publish_wanted({name, {3, 5}}, now_);
  EXPECT_EQ(indices(take_all()), std::vector<int>{5});
  now_ = sent_at + protocol::kPublicationPause;
  book_.publish_wanted({name, {3}}, now_);
  EXPECT_EQ(indices(take_all()), std::vector<int>{3});
}

TEST_F(DefinitionBookTest, IgnoresWhatItDoesNotHave) {
  const DefinitionName name = add(std::string(2 * kPieceBytes, 'c'));
  book_.publish_wanted({name, {-1, 2, 1'000'000}}, now_);
  book_.publish({DefinitionKind::kTask, name.id}, now_);
  EXPECT_FALSE(book_.next_burst());
}

TEST_F(DefinitionBookTest, ALargeDefinitionDoesNotKeepOthersWaiting) {
  const DefinitionName large = add(std::string(protocol::kDefinitionBytesMax, 'l'));
  const DefinitionName small = add("small");
  book_.publish(large, now_);
  book_.publish(small, now_);
  const auto pieces = take_all();
  const auto place = std::find_if(pieces.begin(), pieces.end(), [&](const DefinitionPiece& piece) {
    return piece.name == small;
  });
  EXPECT_LE(place - pieces.begin(), 64);
  EXPECT_EQ(pieces.size(), std::size_t{protocol::kPiecesMax} + 1);
}

TEST_F(DefinitionBookTest, WhatNobodyUsesAnyMoreIsNotSent) {
  const DefinitionName name = add(std::string(100 * kPieceBytes, 'c'));
  add(std::string(100 * kPieceBytes, 'c'));  // a second user
  book_.publish(name, now_);
  book_.release(name);
  EXPECT_FALSE(book_.take_due(9, now_).empty());
  book_.release(name);
  EXPECT_FALSE(book_.next_burst());
  EXPECT_EQ(book_.find(name), nullptr);
}

}  // namespace
}  // namespace treeroll::learner
