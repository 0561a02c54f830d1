#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tests/architecture/rules.h"
#include "tests/architecture/source_file.h"

namespace treeroll::architecture {

/// The file that holds the map from the thesis's equations to functions and tests.
inline constexpr std::string_view kEquationMapPath = "learner/README.md";

/// Numbers of equations in a text: "(3-14)", and all from "(A-1)" to "(A-6)" in "(A-1) to (A-6)".
std::set<std::string> equations_in(const std::string& text);

/// How many numbered equations each chapter of the thesis has that the map must speak of, from 1.
const std::map<std::string, int>& thesis_equations();

/// The map is true and whole. Its section is headed "## Equations of the thesis" and has two kinds
/// of tables:
/// - three columns, | equation | function | test |: the second names, in backticks, files of the
///   tree and words that stand in the file named before them (that of a row above, if none is);
///   the third tests that exist, as `Suite.Name`, `.Name` (of the suite before) or with a `*`;
/// - two columns, | equation | why it has no function |.
/// Every numbered equation of thesis_equations() is in one of them.
std::vector<Finding> check_equation_map(const std::vector<SourceFile>& files);

}  // namespace treeroll::architecture
