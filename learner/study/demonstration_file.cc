#include "learner/study/demonstration_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

#include "learner/fit/csv_demonstration.h"

namespace treeroll {

std::string read_demonstration_file(const std::string& name) {
  constexpr std::size_t kFileBytesMax = std::size_t{16} << 20;
  std::error_code error;
  if (!std::filesystem::is_regular_file(name, error)) {
    throw DemonstrationError(name + ": is no file");
  }
  if (std::filesystem::file_size(name, error) > kFileBytesMax || error) {
    throw DemonstrationError(name + ": must have at most " + std::to_string(kFileBytesMax) +
                             " bytes");
  }
  std::ifstream file(name, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file.is_open() || file.bad()) throw DemonstrationError(name + ": cannot be read");
  return text;
}

}  // namespace treeroll
