#pragma once

#include <Eigen/Core>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "common/policy/policy_registry.h"

namespace treeroll {

/// Files that hold no demonstration: says file, line and column, and what is wrong.
class DemonstrationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One observation a row under a row of column names, as csv_rows.h reads them; numbers may have a
/// plus sign. Other columns are not looked at, except that each row has them all.
/// Throws DemonstrationError on columns that are missing or there twice, on rows of another length
/// and on anything in a wanted column that is not a finite number.
/// @param name     of the file, for errors
/// @param columns  d names: the rows of the result
/// @return         d x N, columns are observations in the order of the lines; N may be 0
Eigen::MatrixXd parse_demonstration(std::string_view text, const std::string& name,
                                    const std::vector<std::string>& columns);

/// The observations of several files, one file after the other, and the hash of their contents. A
/// demonstration has at least 2 observations and at most 100 000.
struct CsvDemonstration {
  Eigen::MatrixXd data;  ///< d x N
  std::string content;   ///< hexadecimal
};
CsvDemonstration read_demonstration_files(const std::vector<std::string>& files,
                                          const std::vector<std::string>& columns,
                                          const FileReader& read_file);

}  // namespace treeroll
