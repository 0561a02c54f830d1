#include "learner/results/csv_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "common/files/whole_file.h"

namespace treeroll {
namespace {

constexpr std::size_t kShownMax = 60;

/// A field as an error shows it: short, and nothing a terminal would obey.
std::string quoted(std::string_view text) {
  std::string short_text(text.substr(0, kShownMax));
  for (char& c : short_text) {
    if (static_cast<unsigned char>(c) < ' ' || c == 0x7f) c = '?';
  }
  return short_text + (text.size() > kShownMax ? "..." : "");
}

/// The whole field as a number.
template <class T>
bool parse(std::string_view text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

CsvReader::CsvReader(const std::filesystem::path& path, std::vector<std::string> columns,
                     std::size_t num_old)
    : name_(path.string()),
      columns_(std::move(columns)),
      content_(read_whole_file(path)),
      fields_(columns_.size()),
      unquoted_(columns_.size()) {
  const std::string header = fmt::format("{}", fmt::join(columns_, ","));
  const auto num_found =
      std::ranges::count(std::string_view(content_).substr(0, content_.find('\n')), ',') + 1;
  if (num_old > 0 && static_cast<std::size_t>(num_found) == num_old) columns_.resize(num_old);
  if (!next()) refuse_line("is empty: must begin with " + header);
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (fields_[i] != columns_[i]) refuse(static_cast<int>(i), "the first line must be " + header);
  }
}

bool CsvReader::next() {
  line_ = next_line_;
  if (position_ == content_.size()) return false;
  for (std::size_t column = 0; column < columns_.size(); ++column) {
    read_field(column);
    const bool at_comma = position_ < content_.size() && content_[position_] == ',';
    const bool last = column + 1 == columns_.size();
    if (at_comma == last) {
      refuse_line(fmt::format("must have {} fields ({}), has {}", columns_.size(),
                              fmt::join(columns_, ","),
                              last ? "more" : std::to_string(column + 1)));
    }
    if (at_comma) ++position_;
  }
  if (position_ == content_.size()) refuse_line("must end with a line break: the file is cut off");
  ++position_;  // read_field stopped at a comma, a line break or the end
  ++next_line_;
  return true;
}

void CsvReader::read_field(std::size_t column) {
  if (position_ < content_.size() && content_[position_] == '"') {
    read_quoted_field(column);
    return;
  }
  const std::size_t begin = position_;
  const char* const end = std::find_if(content_.data() + begin, content_.data() + content_.size(),
                                       [](char c) { return c == ',' || c == '\n'; });
  position_ = static_cast<std::size_t>(end - content_.data());
  fields_[column] = std::string_view(content_).substr(begin, position_ - begin);
  if (position_ < content_.size() && *end == '\n' && fields_[column].ends_with('\r')) {
    fields_[column].remove_suffix(1);
  }
}

void CsvReader::read_quoted_field(std::size_t column) {
  std::string& field = unquoted_[column];
  field.clear();
  for (++position_; position_ < content_.size(); ++position_) {
    const char c = content_[position_];
    if (c == '"') {
      const bool doubled = position_ + 1 < content_.size() && content_[position_ + 1] == '"';
      if (!doubled) break;
      ++position_;
    }
    if (c == '\n') ++next_line_;
    field += c;
  }
  if (position_ == content_.size()) refuse_line("a quoted field does not end");
  ++position_;
  if (position_ + 1 < content_.size() && content_[position_] == '\r') ++position_;
  if (position_ < content_.size() && content_[position_] != ',' && content_[position_] != '\n') {
    refuse_line("a quoted field must be followed by a comma or the line's end");
  }
  fields_[column] = field;
}

std::int64_t CsvReader::integer(int column, std::int64_t min, std::int64_t max) const {
  std::int64_t value = 0;
  if (!parse(text(column), value) || value < min || value > max) {
    refuse(column, fmt::format("must be a whole number from {} to {}", min, max));
  }
  return value;
}

std::vector<std::int64_t> CsvReader::integers(int column, std::int64_t min,
                                              std::int64_t max) const {
  std::vector<std::int64_t> values;
  std::string_view rest = text(column);
  for (bool more = !rest.empty(); more;) {
    const std::size_t end = rest.find(';');
    std::int64_t value = 0;
    if (!parse(rest.substr(0, end), value) || value < min || value > max) {
      refuse(column, fmt::format("must be whole numbers from {} to {}, ';' between", min, max));
    }
    values.push_back(value);
    more = end != std::string_view::npos;
    if (more) rest.remove_prefix(end + 1);
  }
  return values;
}

std::optional<double> CsvReader::as_reward(std::string_view word) {
  double value = 0;
  if (!parse(word, value) || !std::isfinite(value) || value < 0) return std::nullopt;
  return value;
}

double CsvReader::reward(int column) const {
  const std::optional<double> value = as_reward(text(column));
  if (!value) refuse(column, "must be a finite number, not negative");
  return *value;
}

void CsvReader::refuse(int column, const std::string& rule) const {
  throw std::runtime_error(fmt::format("{}:{}: {} = {}: {}", name_, line_,
                                       columns_[static_cast<std::size_t>(column)],
                                       quoted(text(column)), rule));
}

void CsvReader::refuse_line(const std::string& rule) const {
  throw std::runtime_error(fmt::format("{}:{}: {}", name_, line_, rule));
}

}  // namespace treeroll
