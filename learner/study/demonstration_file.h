#pragma once

#include <string>

namespace treeroll {

/// The text of a file of a demonstration. Throws DemonstrationError, naming the file, if it is no
/// file, cannot be read or has more than 16 MB.
std::string read_demonstration_file(const std::string& name);

}  // namespace treeroll
