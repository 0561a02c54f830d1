#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/bad_input.h"
#include "common/policy/policy_registry.h"
#include "learner/fit/alignment.h"

namespace treeroll {

/// Files that hold no demonstration: says file, line and column, and what is wrong.
class DemonstrationError : public BadInput {
 public:
  using BadInput::BadInput;
};

/// No field of a wanted column may be empty.
inline constexpr std::size_t kAllNeeded = static_cast<std::size_t>(-1);

/// One observation a row under a row of column names, as csv_rows.h reads them; numbers may have a
/// plus sign. Other columns are not looked at, except that each row has them all.
/// Throws DemonstrationError on columns that are missing or there twice, on rows of another length
/// and on anything in a wanted column that is not a finite number. Where fields may be empty, it
/// throws on a row in which all of those are.
/// @param name     of the file, for errors
/// @param columns  d names: the rows of the result
/// @param num_needed  the columns after so many may have empty fields, which become NaN
/// @return         d x N, columns are observations in the order of the lines; N may be 0
Eigen::MatrixXd parse_demonstration(std::string_view text, const std::string& name,
                                    const std::vector<std::string>& columns,
                                    std::size_t num_needed = kAllNeeded);

/// A demonstration has at least 2 observations and at most 100 000.
struct CsvDemonstration {
  Eigen::MatrixXd data;  ///< d x N
  /// The same as CSV with "\n": the columns asked for, numbers in their shortest exact form. What
  /// reads it gets the same bits; where the files lay and how their lines ended is not in it.
  std::string text;
  std::string content;  ///< content_hash() of the text, hexadecimal
  /// What earlier versions called the content: a hash of the bytes of the files.
  std::string content_of_files = {};
  /// Of the files that were read. A text does not tell.
  Alignment alignment = Alignment::kNone;
};

/// The observations of several files, one file after the other. Throws DemonstrationError.
/// @param alignment  of their times, which are the first column: none for a single file
CsvDemonstration read_demonstration_files(const std::vector<std::string>& files,
                                          const std::vector<std::string>& columns,
                                          const FileReader& read_file,
                                          Alignment alignment = Alignment::kNone,
                                          std::size_t num_needed = kAllNeeded);

/// The demonstration whose CsvDemonstration::text this is, from outside. Throws DemonstrationError
/// also if its content is another.
CsvDemonstration read_demonstration_text(const std::string& text, const std::string& content,
                                         const std::vector<std::string>& columns,
                                         std::size_t num_needed = kAllNeeded);

}  // namespace treeroll
