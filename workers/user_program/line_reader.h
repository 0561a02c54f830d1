#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

namespace treeroll::worker {

/// Lines out of the bytes of a pipe, as they come. A carriage return before a line break belongs to
/// the break.
class LineReader {
 public:
  /// @param piece_bytes_max  a line that is longer comes in pieces of this size
  explicit LineReader(std::size_t piece_bytes_max = std::string::npos)
      : piece_bytes_max_(piece_bytes_max) {}

  void add(std::string_view bytes);
  /// The other side has ended: what is left is a line too.
  void finish();
  /// The oldest whole line that is there.
  std::optional<std::string> next();
  /// Of the line that has not ended yet.
  std::size_t num_bytes_unfinished() const { return unfinished_.size(); }

 private:
  void end_line();

  std::size_t piece_bytes_max_;
  std::string unfinished_;
  std::deque<std::string> lines_;
};

}  // namespace treeroll::worker
