#include "workers/core/piece_table.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "common/protocol/pieces.h"

namespace treeroll::worker {
namespace {

using protocol::DefinitionKind;
using protocol::DefinitionName;
using protocol::DefinitionPiece;
using protocol::kPieceBytes;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr protocol::LearnerId kLearner = 1;

std::string content_of(std::size_t num_bytes, char salt = 0) {
  std::string content(num_bytes, salt);
  for (std::size_t i = 0; i < num_bytes; ++i) content[i] = static_cast<char>(salt + i % 113);
  return content;
}

DefinitionName name_of(const std::string& content) {
  return {DefinitionKind::kPolicy, content_hash(content)};
}

DefinitionPiece piece_of(const std::string& content, int index,
                         protocol::LearnerId learner = kLearner) {
  return protocol::definition_piece(learner, name_of(content), content, index);
}

class PieceTableTest : public ::testing::Test {
 protected:
  PieceTable::Added add(const DefinitionPiece& piece) {
    return table_.add(piece, [this] { return waited_for_; });
  }

  PieceTable table_{16, 64 * kPieceBytes};
  std::set<PartialName> waited_for_;
};

TEST_F(PieceTableTest, PutsPiecesTogetherInWhateverOrderTheyCome) {
  const std::string content = content_of(20 * kPieceBytes + 3);
  std::vector<int> order(21);
  for (int i = 0; i < 21; ++i) order[static_cast<std::size_t>(i)] = i;
  std::shuffle(order.begin(), order.end(), std::mt19937(7));
  for (std::size_t i = 0; i < order.size(); ++i) {
    const PieceTable::Added added = add(piece_of(content, order[i]));
    EXPECT_TRUE(added.refusal.empty());
    EXPECT_EQ(added.whole.has_value(), i + 1 == order.size());
    EXPECT_EQ(added.whole.value_or(content), content);
  }
  EXPECT_EQ(table_.size(), 0U);
  EXPECT_EQ(table_.bytes(), 0U);
}

TEST_F(PieceTableTest, NamesWhatIsMissing) {
  const std::string content = content_of(5 * kPieceBytes);
  const PartialName name{kLearner, name_of(content)};
  EXPECT_THAT(table_.missing(name), IsEmpty());
  add(piece_of(content, 1));
  add(piece_of(content, 4));
  EXPECT_THAT(table_.missing(name), ElementsAre(0, 2, 3));
}

TEST_F(PieceTableTest, APieceThatComesTwiceCountsOnce) {
  const std::string content = content_of(3 * kPieceBytes);
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(add(piece_of(content, 0)).whole);
  EXPECT_EQ(table_.bytes(), kPieceBytes);
  add(piece_of(content, 1));
  EXPECT_EQ(add(piece_of(content, 2)).whole, content);
}

TEST_F(PieceTableTest, WhatIsNotWhatItsIdNamesIsDroppedAndComesAgain) {
  const std::string content = content_of(2 * kPieceBytes);
  DefinitionPiece forged = piece_of(content, 0);
  forged.bytes[17] ^= 1;
  add(forged);
  EXPECT_THAT(add(piece_of(content, 1)).refusal, HasSubstr("not what its id names"));
  EXPECT_EQ(table_.size(), 0U);
  add(piece_of(content, 1));
  EXPECT_EQ(add(piece_of(content, 0)).whole, content);
}

TEST_F(PieceTableTest, AnotherTotalBeginsAnewSoAWrongOneCannotKeepADefinitionOut) {
  const std::string content = content_of(3 * kPieceBytes);
  add(piece_of(content, 0));
  DefinitionPiece wrong = piece_of(content, 1);
  wrong.num_bytes = 8 * static_cast<int>(kPieceBytes);
  EXPECT_FALSE(add(wrong).whole);
  EXPECT_EQ(table_.bytes(), kPieceBytes);
  for (const int index : {0, 1}) EXPECT_FALSE(add(piece_of(content, index)).whole);
  EXPECT_EQ(add(piece_of(content, 2)).whole, content);
}

TEST_F(PieceTableTest, APieceThatFitsNoWholeIsRefused) {
  DefinitionPiece piece = piece_of(content_of(3 * kPieceBytes), 1);
  piece.index = 3;
  EXPECT_THAT(add(piece).refusal,
              HasSubstr("piece 3 with 1024 bytes does not fit a whole of 3072"));
  EXPECT_EQ(table_.size(), 0U);
}

TEST_F(PieceTableTest, WhatOtherLearnersSendUnderTheSameNameDoesNotMix) {
  const std::string content = content_of(2 * kPieceBytes);
  DefinitionPiece forged = piece_of(content, 0, 66);
  forged.bytes.assign(kPieceBytes, 'x');
  add(forged);
  add(piece_of(content, 0));
  EXPECT_EQ(add(piece_of(content, 1)).whole, content);
}

TEST_F(PieceTableTest, AFloodOfNamesStaysWithinItsBoundsAndWhatIsWaitedForStays) {
  const std::string wanted = content_of(3 * kPieceBytes, 'w');
  waited_for_ = {{kLearner, name_of(wanted)}};
  add(piece_of(wanted, 0));
  for (int i = 0; i < 5000; ++i) {
    const std::string other = std::to_string(i) + content_of(30 * kPieceBytes);
    for (const int index : {3, 4, 5, 6, 7}) add(piece_of(other, index));
    ASSERT_LE(table_.size(), 16U);
    ASSERT_LE(table_.bytes(), 64 * kPieceBytes);
  }
  add(piece_of(wanted, 1));
  EXPECT_EQ(add(piece_of(wanted, 2)).whole, wanted);
}

/// Pieces come in turn, as learners send them, and find no room for all.
TEST_F(PieceTableTest, WhereAllIsWaitedForAllIsFinishedInTheEnd) {
  for (const std::size_t num_pieces : {2U, 6U}) {  // bounded by number, and by bytes
    std::map<PartialName, std::string> contents;
    for (int i = 0; i < 24; ++i) {
      const std::string content = std::to_string(100 + i) + content_of(num_pieces * kPieceBytes);
      contents.emplace(PartialName{kLearner, name_of(content)}, content);
      waited_for_.insert({kLearner, name_of(content)});
    }
    for (int round = 0; round < 100 && !contents.empty(); ++round) {
      for (int index = 0; index <= static_cast<int>(num_pieces); ++index) {
        std::erase_if(contents, [&](const auto& one) {
          const bool whole = add(piece_of(one.second, index)).whole.has_value();
          if (whole) waited_for_.erase(one.first);
          return whole;
        });
        EXPECT_LE(table_.size(), 16U);
        EXPECT_LE(table_.bytes(), 64 * kPieceBytes);
      }
    }
    EXPECT_THAT(contents, IsEmpty()) << num_pieces;
  }
}

}  // namespace
}  // namespace treeroll::worker
