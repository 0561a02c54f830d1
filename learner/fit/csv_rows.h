#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace treeroll {

/// The rows of a CSV text as people and spreadsheets write them (RFC 4180): commas between fields,
/// quotes around those that need them, blanks around fields without meaning, lines that end with
/// "\n", "\r\n" or "\r", blank lines at the end. The text must outlive this.
///
///   CsvRows rows(text, "demo.csv");
///   while (rows.next()) use(rows.fields(), rows.place());
class CsvRows {
 public:
  /// @param name  of the file, for errors
  CsvRows(std::string_view text, std::string name);

  /// Goes to the next row. False at the end. Throws DemonstrationError on a quote that does not
  /// end, on text beside a quoted field, on a blank line that others follow and on too many fields.
  bool next();
  const std::vector<std::string>& fields() const { return fields_; }
  /// "demo.csv:3", where the row begins.
  std::string place() const;

 private:
  bool read_row();
  bool is_blank() const;
  void skip_blanks();
  void read_quoted();
  bool at_line_end() const;
  void skip_line_end();

  std::string_view text_;
  std::string name_;
  std::size_t begin_ = 0;     ///< of the row
  std::size_t position_ = 0;  ///< of what is read next
  int line_ = 1;              ///< of the row's beginning
  int next_line_ = 1;         ///< quoted fields may hold line breaks
  std::vector<std::string> fields_;
};

}  // namespace treeroll
