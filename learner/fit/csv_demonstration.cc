#include "learner/fit/csv_demonstration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <system_error>
#include <utility>

#include "common/base/content_hash.h"
#include "common/base/csv_field.h"
#include "learner/fit/csv_rows.h"

namespace treeroll {
namespace {

constexpr Eigen::Index kObservationsMax = 100'000;
/// Squares of larger numbers leave the range in which a mixture is checked.
constexpr double kMagnitudeMax = 1e20;

[[noreturn]] void refuse(const std::string& place, const std::string& rule) {
  throw DemonstrationError(fmt::format("{}: {}", place, rule));
}

/// Text from a file as an error may show it.
std::string shown(std::string_view text) {
  constexpr std::size_t kLengthMax = 40;
  std::string result = "\"";
  for (const char c : text.substr(0, kLengthMax)) result += c >= ' ' && c <= '~' ? c : '?';
  return result + (text.size() > kLengthMax ? "...\"" : "\"");
}

/// The names in a line whose fields have something else than a comma between them.
std::vector<std::string> names_of(std::string_view line, char separator) {
  std::string with_commas(line);
  std::replace(with_commas.begin(), with_commas.end(), separator, ',');
  CsvRows rows(with_commas, "");
  try {
    return rows.next() ? rows.fields() : std::vector<std::string>{};
  } catch (const DemonstrationError&) {
    return {};
  }
}

/// Says what separates the names of the first line where it is no comma.
void check_separator(std::string_view text, const std::string& place,
                     const std::vector<std::string>& columns) {
  const std::string_view line = text.substr(0, text.find_first_of("\r\n"));
  if (line.find(',') != std::string_view::npos) return;
  constexpr std::array<std::pair<char, const char*>, 4> kOthers{
      {{';', "semicolons"}, {'\t', "tabs"}, {'|', "bars"}, {' ', "blanks"}}};
  for (const auto& [separator, word] : kOthers) {
    if (line.find(separator) == std::string_view::npos) continue;
    const std::vector<std::string> names = names_of(line, separator);
    const bool has_all =
        std::all_of(columns.begin(), columns.end(), [&](const std::string& column) {
          return std::find(names.begin(), names.end(), column) != names.end();
        });
    if (!has_all) continue;
    refuse(place, fmt::format("its columns have {} between them, must have commas (and points, not "
                              "commas, in numbers)",
                              word));
  }
}

/// Where each wanted column stands.
std::vector<std::size_t> find_columns(const std::vector<std::string>& names,
                                      const std::string& place,
                                      const std::vector<std::string>& columns) {
  std::vector<std::size_t> found;
  for (const std::string& column : columns) {
    const auto here = std::find(names.begin(), names.end(), column);
    if (here == names.end()) {
      std::vector<std::string> known;
      for (const std::string& name : names) known.push_back(shown(name));
      refuse(place, fmt::format("has no column {}; its columns are {}", shown(column),
                                fmt::join(known, ", ")));
    }
    if (std::find(here + 1, names.end(), column) != names.end()) {
      refuse(place, fmt::format("has the column {} twice", shown(column)));
    }
    found.push_back(static_cast<std::size_t>(here - names.begin()));
  }
  return found;
}

double number_of(const std::string& field, const std::string& place, const std::string& column) {
  double number = 0;
  const char* const end = field.data() + field.size();
  const bool has_plus = field.size() > 1 && field[0] == '+' && field[1] != '-';
  const auto [stopped, error] = std::from_chars(field.data() + (has_plus ? 1 : 0), end, number);
  // A number too small for a double, 1e-310 or 1e-400, is the nearest one there is.
  if (error == std::errc::result_out_of_range) number = std::strtod(field.c_str(), nullptr);
  const bool is_number = error == std::errc() || error == std::errc::result_out_of_range;
  if (!is_number || stopped != end || !(std::abs(number) <= kMagnitudeMax)) {
    refuse(place, fmt::format("column {} is {}: must be a finite number of at most {} either side "
                              "of 0",
                              shown(column), shown(field), kMagnitudeMax));
  }
  return number;
}

std::string text_of(const Eigen::MatrixXd& data, const std::vector<std::string>& columns) {
  std::string text;
  for (const std::string& column : columns) text += (text.empty() ? "" : ",") + csv_field(column);
  text += '\n';
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    for (Eigen::Index i = 0; i < data.rows(); ++i) {
      if (i > 0) text += ',';
      if (!std::isnan(data(i, n))) fmt::format_to(std::back_inserter(text), "{}", data(i, n));
    }
    text += '\n';
  }
  return text;
}

void check_size(Eigen::Index num_observations, const std::string& place) {
  if (num_observations <= kObservationsMax) return;
  refuse(place,
         fmt::format("all files together must hold at most {} observations", kObservationsMax));
}

/// What alignment needs of the times of a file.
void check_times(const Eigen::RowVectorXd& times, const std::string& file,
                 const std::string& column) {
  for (Eigen::Index n = 1; n < times.size(); ++n) {
    if (times[n] >= times[n - 1]) continue;
    refuse(file,
           fmt::format("column {} falls from {} to {} at observation {}: to be aligned it must "
                       "be a time that does not",
                       shown(column), times[n - 1], times[n], n + 1));
  }
  if (times.size() < 2 || times[0] == times[times.size() - 1]) {
    refuse(file, fmt::format("column {} does not vary: to be aligned it must be a time that does",
                             shown(column)));
  }
}

void check_pairs(const std::vector<Eigen::MatrixXd>& demonstrations, Alignment alignment,
                 const std::string& place) {
  const double pairs = warped_pairs(demonstrations, alignment);
  if (pairs <= kWarpedPairsMax) return;
  refuse(place,
         fmt::format("dynamic time warping of all files compares {:.0f} pairs of observations, "
                     "must be at most {:.0f}",
                     pairs, kWarpedPairsMax));
}

}  // namespace

Eigen::MatrixXd parse_demonstration(std::string_view text, const std::string& name,
                                    const std::vector<std::string>& columns,
                                    std::size_t num_needed) {
  CsvRows rows(text, name);  // first: it refuses what is no UTF-8
  check_separator(text, name + ":1", columns);
  if (!rows.next()) refuse(name, "is empty: must begin with a line of column names");
  const std::size_t num_fields = rows.fields().size();
  const std::vector<std::size_t> wanted = find_columns(rows.fields(), rows.place(), columns);
  std::vector<double> numbers;
  while (rows.next()) {
    if (rows.fields().size() != num_fields) {
      refuse(rows.place(), fmt::format("has {} columns, must have the {} of the first line",
                                       rows.fields().size(), num_fields));
    }
    std::size_t num_missing = 0;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      const std::string& field = rows.fields()[wanted[i]];
      const bool is_missing = i >= num_needed && field.empty();
      num_missing += is_missing ? 1 : 0;
      numbers.push_back(is_missing ? std::numeric_limits<double>::quiet_NaN()
                                   : number_of(field, rows.place(), columns[i]));
    }
    if (num_missing > 0 && num_missing == columns.size() - num_needed) {
      refuse(rows.place(), "has no output: an observation must have one at least");
    }
  }
  const auto dim = static_cast<Eigen::Index>(columns.size());
  return Eigen::Map<const Eigen::MatrixXd>(numbers.data(), dim,
                                           static_cast<Eigen::Index>(numbers.size()) / dim);
}

CsvDemonstration read_demonstration_files(const std::vector<std::string>& files,
                                          const std::vector<std::string>& columns,
                                          const FileReader& read_file, Alignment alignment,
                                          std::size_t num_needed) {
  if (!read_file) refuse(files.front(), "cannot be read: there are no files here");
  std::vector<Eigen::MatrixXd> demonstrations;
  CsvDemonstration result;
  Eigen::Index num_observations = 0;
  std::string hashes;
  for (const std::string& file : files) {
    const std::string text = read_file(file);
    hashes += to_hex(content_hash(text));
    demonstrations.push_back(parse_demonstration(text, file, columns, num_needed));
    num_observations += demonstrations.back().cols();
    check_size(num_observations, file);
    if (alignment != Alignment::kNone) check_times(demonstrations.back().row(0), file, columns[0]);
  }
  check_pairs(demonstrations, alignment, files.front());
  align(demonstrations, alignment);
  result.data.resize(static_cast<Eigen::Index>(columns.size()), num_observations);
  Eigen::Index filled = 0;
  for (const Eigen::MatrixXd& one : demonstrations) {
    result.data.middleCols(filled, one.cols()) = one;
    filled += one.cols();
  }
  if (result.data.cols() < 2) refuse(files.front(), "holds less than 2 observations");
  result.text = text_of(result.data, columns);
  result.content = to_hex(content_hash(result.text));
  result.content_of_files = to_hex(content_hash(hashes));
  result.alignment = alignment;
  return result;
}

CsvDemonstration read_demonstration_text(const std::string& text, const std::string& content,
                                         const std::vector<std::string>& columns,
                                         std::size_t num_needed) {
  const std::string place = "demonstrations." + content;
  const std::string found = to_hex(content_hash(text));
  if (found != content) refuse(place, "has another content, " + found);
  CsvDemonstration result;
  result.data = parse_demonstration(text, place, columns, num_needed);
  check_size(result.data.cols(), place);
  if (result.data.cols() < 2) refuse(place, "holds less than 2 observations");
  result.text = text;
  result.content = content;
  return result;
}

}  // namespace treeroll
