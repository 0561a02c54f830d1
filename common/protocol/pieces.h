#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/protocol/limits.h"
#include "common/protocol/messages.h"

/// Contents of any size in messages of one frame: pieces of kPieceBytes, the last one shorter.
namespace treeroll::protocol {

/// Of a content of so many bytes, at least 1.
constexpr int num_pieces(std::size_t num_bytes) {
  return static_cast<int>((num_bytes + kPieceBytes - 1) / kPieceBytes);
}

/// Precondition: 0 <= index < num_pieces(content.size()).
std::string_view piece_of(std::string_view content, int index);

/// A piece as a message. Precondition: as of piece_of(), and kDefinitionBytesMax is kept.
DefinitionPiece definition_piece(LearnerId learner, const DefinitionName& name,
                                 std::string_view content, int index);

/// Whether number, size and the whole's size go together.
bool is_sound(const DefinitionPiece& piece);

/// A theta as a content: eight bytes a number, big-endian as on LCM.
std::string content_of_theta(const std::vector<double>& theta);
/// Nothing for what is no such content: of another length, too long, empty, or not finite.
std::optional<std::vector<double>> theta_of_content(std::string_view content);

}  // namespace treeroll::protocol
