#include "common/protocol/pieces.h"

#include <gtest/gtest.h>

#include <limits>

namespace treeroll::protocol {
namespace {

std::string content_of(std::size_t num_bytes) {
  std::string content(num_bytes, '\0');
  for (std::size_t i = 0; i < num_bytes; ++i) content[i] = static_cast<char>(i * 7 % 251);
  return content;
}

TEST(PiecesTest, TogetherAreTheContentWhateverItsSize) {
  for (const std::size_t size : {std::size_t{1}, kPieceBytes - 1, kPieceBytes, kPieceBytes + 1,
                                 5 * kPieceBytes, kDefinitionBytesMax}) {
    const std::string content = content_of(size);
    std::string together;
    for (int index = 0; index < num_pieces(size); ++index) {
      const DefinitionPiece piece = definition_piece(7, {}, content, index);
      EXPECT_TRUE(is_sound(piece)) << size << ", piece " << index;
      EXPECT_EQ(piece.index, index);
      EXPECT_EQ(piece.num_bytes, static_cast<int>(size));
      together += piece.bytes;
    }
    EXPECT_EQ(together, content);
  }
  EXPECT_EQ(num_pieces(kDefinitionBytesMax), kPiecesMax);
}

TEST(PiecesTest, WhatDoesNotFitItsWholeIsNotSound) {
  const std::string content = content_of(3 * kPieceBytes + 5);
  const auto changed = [&](int index, auto change) {
    DefinitionPiece piece = definition_piece(7, {}, content, index);
    change(piece);
    return is_sound(piece);
  };
  EXPECT_TRUE(changed(3, [](auto&) {}));
  EXPECT_FALSE(changed(0, [](auto& piece) { piece.index = 3; }));
  EXPECT_FALSE(changed(3, [](auto& piece) { piece.index = 4; }));
  EXPECT_FALSE(changed(3, [](auto& piece) { piece.index = -1; }));
  EXPECT_FALSE(changed(3, [](auto& piece) { piece.num_bytes += 1; }));
  EXPECT_FALSE(changed(0, [](auto& piece) { piece.num_bytes = 0; }));
  EXPECT_FALSE(changed(0, [](auto& piece) { piece.num_bytes = -5; }));
  EXPECT_FALSE(changed(0, [](auto& piece) { piece.num_bytes = kDefinitionBytesMax + 1; }));
  EXPECT_FALSE(changed(1, [](auto& piece) { piece.bytes.pop_back(); }));
  EXPECT_FALSE(changed(1, [](auto& piece) { piece.bytes += 'x'; }));
}

TEST(PiecesTest, AThetaGoesRoundToTheBit) {
  const std::vector<double> theta = {0.,
                                     -0.,
                                     1.,
                                     -1e-300,
                                     std::numeric_limits<double>::denorm_min(),
                                     std::numeric_limits<double>::max()};
  const std::string content = content_of_theta(theta);
  EXPECT_EQ(content.substr(16, 8), std::string("\x3f\xf0\0\0\0\0\0\0", 8)) << "big-endian";
  const auto back = theta_of_content(content);
  ASSERT_TRUE(back);
  EXPECT_EQ(content_of_theta(*back), content);
}

TEST(PiecesTest, WhatIsNoThetaIsRefused) {
  EXPECT_FALSE(theta_of_content(""));
  EXPECT_FALSE(theta_of_content("1234567"));
  EXPECT_FALSE(theta_of_content(content_of_theta({1, std::numeric_limits<double>::infinity()})));
  EXPECT_FALSE(theta_of_content(content_of_theta({std::numeric_limits<double>::quiet_NaN()})));
  EXPECT_TRUE(theta_of_content(content_of_theta(std::vector<double>(kThetaDimMax, 1.))));
  EXPECT_FALSE(theta_of_content(content_of_theta(std::vector<double>(kThetaDimMax + 1, 1.))));
}

}  // namespace
}  // namespace treeroll::protocol
