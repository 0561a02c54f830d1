#include "workers/user_program/line_reader.h"

#include <algorithm>
#include <utility>

namespace treeroll::worker {

void LineReader::add(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::size_t room = piece_bytes_max_ - unfinished_.size();
    const std::size_t end = bytes.find('\n');
    const std::size_t size = std::min({end, room, bytes.size()});
    unfinished_.append(bytes.substr(0, size));
    bytes.remove_prefix(size);
    if (size == end) {
      end_line();
      bytes.remove_prefix(1);
    } else if (size == room) {
      end_line();
    }
  }
}

void LineReader::finish() {
  if (!unfinished_.empty()) end_line();
}

void LineReader::end_line() {
  if (unfinished_.ends_with('\r')) unfinished_.pop_back();
  lines_.push_back(std::exchange(unfinished_, {}));
}

std::optional<std::string> LineReader::next() {
  if (lines_.empty()) return std::nullopt;
  std::string line = std::move(lines_.front());
  lines_.pop_front();
  return line;
}

}  // namespace treeroll::worker
