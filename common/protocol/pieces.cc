#include "common/protocol/pieces.h"

#include <bit>
#include <cmath>
#include <cstdint>

#include "common/base/check.h"

namespace treeroll::protocol {

std::string_view piece_of(std::string_view content, int index) {
  CHECK(index >= 0 && index < num_pieces(content.size()), "a piece that a content does not have");
  return content.substr(static_cast<std::size_t>(index) * kPieceBytes, kPieceBytes);
}

DefinitionPiece definition_piece(LearnerId learner, const DefinitionName& name,
                                 std::string_view content, int index) {
  CHECK(content.size() <= kDefinitionBytesMax, "a definition too large to travel");
  return {.learner_id = learner,
          .name = name,
          .num_bytes = static_cast<std::int32_t>(content.size()),
          .index = index,
          .bytes = std::string(piece_of(content, index))};
}

bool is_sound(const DefinitionPiece& piece) {
  if (piece.num_bytes < 1 || piece.index < 0) return false;
  const auto num_bytes = static_cast<std::size_t>(piece.num_bytes);
  if (num_bytes > kDefinitionBytesMax || piece.index >= num_pieces(num_bytes)) return false;
  const bool is_last = piece.index == num_pieces(num_bytes) - 1;
  const std::size_t before = static_cast<std::size_t>(piece.index) * kPieceBytes;
  return piece.bytes.size() == (is_last ? num_bytes - before : kPieceBytes);
}

std::string content_of_theta(const std::vector<double>& theta) {
  std::string content;
  content.reserve(8 * theta.size());
  for (const double number : theta) {
    const auto bits = std::bit_cast<std::uint64_t>(number);
    for (int shift = 56; shift >= 0; shift -= 8) {
      content.push_back(static_cast<char>(static_cast<unsigned char>(bits >> shift)));
    }
  }
  return content;
}

std::optional<std::vector<double>> theta_of_content(std::string_view content) {
  if (content.empty() || content.size() % 8 != 0) return std::nullopt;
  if (content.size() / 8 > static_cast<std::size_t>(kThetaDimMax)) return std::nullopt;
  std::vector<double> theta;
  theta.reserve(content.size() / 8);
  for (std::size_t at = 0; at < content.size(); at += 8) {
    std::uint64_t bits = 0;
    for (const char byte : content.substr(at, 8)) {
      bits = bits << 8U | static_cast<unsigned char>(byte);
    }
    theta.push_back(std::bit_cast<double>(bits));
    if (!std::isfinite(theta.back())) return std::nullopt;
  }
  return theta;
}

}  // namespace treeroll::protocol
