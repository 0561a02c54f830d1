#include "workers/user_program/line_reader.h"

#include <utility>

namespace treeroll::worker {

void LineReader::add(std::string_view bytes) {
  for (;;) {
    const std::size_t end = bytes.find('\n');
    unfinished_.append(bytes.substr(0, end));
    if (end == std::string_view::npos) return;
    end_line();
    bytes.remove_prefix(end + 1);
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
