#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace treeroll {

/// A table in CSV (RFC 4180; lines end with "\n" or "\r\n"), read whole and trusted in nothing.
/// Every refusal is a std::runtime_error "FILE:LINE: COLUMN = VALUE: RULE". One thread.
///
///   CsvReader table(path, {"run", "reward"});
///   while (table.next()) use(table.integer(0, 0, 99), table.number(1));
class CsvReader {
 public:
  /// Reads the file and checks its first line against `columns`, all of them in this order.
  /// @param num_old  so many of them an earlier version wrote: the others may lack, and are empty
  ///                 then. 0: none may lack
  CsvReader(const std::filesystem::path& path, std::vector<std::string> columns,
            std::size_t num_old = 0);
  CsvReader(const CsvReader&) = delete;
  CsvReader& operator=(const CsvReader&) = delete;

  /// Goes to the next row, which must have a field a column. False at the end of the file.
  bool next();

  /// The fields of the row, valid until next().
  std::string_view text(int column) const { return fields_[static_cast<std::size_t>(column)]; }
  bool empty(int column) const { return text(column).empty(); }
  std::int64_t integer(int column, std::int64_t min, std::int64_t max) const;
  /// Whole numbers with ";" between them; none of an empty field.
  std::vector<std::int64_t> integers(int column, std::int64_t min, std::int64_t max) const;
  /// Finite and not negative, as every reward is.
  double reward(int column) const;
  /// A word as such a number; nothing if it is none.
  static std::optional<double> as_reward(std::string_view word);

  /// Refuses the row, for a rule of the caller's own.
  [[noreturn]] void refuse(int column, const std::string& rule) const;

 private:
  void read_field(std::size_t column);
  void read_quoted_field(std::size_t column);
  [[noreturn]] void refuse_line(const std::string& rule) const;

  std::string name_;
  std::vector<std::string> columns_;
  std::string content_;
  std::size_t position_ = 0;
  std::int64_t line_ = 1;       ///< of the current row's beginning
  std::int64_t next_line_ = 1;  ///< quoted fields may hold line breaks
  std::vector<std::string_view> fields_;
  std::vector<std::string> unquoted_;  ///< what quoted fields stand for
};

}  // namespace treeroll
