#include "learner/fit/csv_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "learner/fit/csv_demonstration.h"

namespace treeroll {
namespace {

constexpr std::size_t kFieldsMax = 1000;
constexpr std::string_view kBlanks = " \t";

}  // namespace

CsvRows::CsvRows(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (text_.starts_with(kByteOrderMark)) text_.remove_prefix(kByteOrderMark.size());
  if (text_.starts_with("\xff\xfe") || text_.starts_with("\xfe\xff")) {
    throw DemonstrationError(name_ + ": is UTF-16: must be saved as UTF-8");
  }
}

bool CsvRows::next() {
  std::string blank;  // the first of the blank lines before the row
  while (read_row()) {
    if (is_blank()) {
      if (blank.empty()) blank = place();
      continue;
    }
    if (blank.empty()) return true;
    throw DemonstrationError(blank + ": is blank: only lines at the end may be");
  }
  return false;
}

bool CsvRows::read_row() {
  begin_ = position_;
  line_ = next_line_;
  fields_.clear();
  if (position_ == text_.size()) return false;
  for (bool more = true; more;) {
    if (fields_.size() == kFieldsMax) {
      throw DemonstrationError(
          fmt::format("{}: must have at most {} columns", place(), kFieldsMax));
    }
    fields_.emplace_back();
    skip_blanks();
    if (position_ < text_.size() && text_[position_] == '"') {
      read_quoted();
    } else {
      const std::size_t end = std::min(text_.find_first_of(",\r\n", position_), text_.size());
      const std::string_view field = text_.substr(position_, end - position_);
      fields_.back() = field.substr(0, field.find_last_not_of(kBlanks) + 1);
      position_ = end;
    }
    more = !at_line_end();
    if (more) ++position_;  // the comma
  }
  skip_line_end();
  return true;
}

void CsvRows::read_quoted() {
  for (++position_;; ++position_) {
    if (position_ == text_.size()) {
      throw DemonstrationError(place() + ": a field in quotes does not end");
    }
    const char c = text_[position_];
    if (c == '"') {
      if (!text_.substr(position_ + 1).starts_with('"')) break;
      ++position_;
    }
    if (c == '\n') ++next_line_;
    fields_.back() += c;
  }
  ++position_;
  skip_blanks();
  if (at_line_end() || text_[position_] == ',') return;
  throw DemonstrationError(place() +
                           ": after a field in quotes must stand a comma or the line's end");
}

void CsvRows::skip_blanks() {
  position_ = std::min(text_.find_first_not_of(kBlanks, position_), text_.size());
}

bool CsvRows::at_line_end() const {
  return position_ == text_.size() || text_[position_] == '\n' || text_[position_] == '\r';
}

void CsvRows::skip_line_end() {
  if (text_.substr(position_).starts_with("\r\n")) ++position_;
  if (position_ < text_.size()) ++position_;
  ++next_line_;
}

std::string CsvRows::place() const { return fmt::format("{}:{}", name_, line_); }

bool CsvRows::is_blank() const {
  return text_.substr(begin_, position_ - begin_).find_first_not_of(" \t\r\n") ==
         std::string_view::npos;
}

}  // namespace treeroll
