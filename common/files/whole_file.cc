#include "common/files/whole_file.h"

#include <cerrno>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace treeroll {

std::string read_whole_file(const std::filesystem::path& path) {
  constexpr std::uintmax_t kBytesMax = std::uintmax_t{1} << 32;
  const auto fail = [&path](const std::string& reason) {
    throw std::runtime_error("cannot read " + path.string() + ": " + reason);
  };
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) fail("no such file");
  if (error) fail(error.message());
  if (!std::filesystem::is_regular_file(status)) fail("must be a regular file");
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) fail(error.message());
  if (size > kBytesMax) fail("is too large: must be at most 4 GB");
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(std::generic_category().message(errno));
  std::string content(size, '\0');
  file.read(content.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uintmax_t>(file.gcount()) != size) fail("changed while it was read");
  return content;
}

}  // namespace treeroll
