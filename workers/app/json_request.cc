#include "workers/app/json_request.h"

#include <fmt/format.h>

#include <iostream>

#include "common/base/config_error.h"

namespace treeroll::worker {

std::string shown(const std::string& text) {
  constexpr std::size_t kShownBytesMax = 200;
  return text.substr(0, kShownBytesMax);
}

std::string read_standard_input(const std::string& key, std::size_t bytes_max) {
  std::string content(bytes_max + 1, '\0');
  std::cin.read(content.data(), static_cast<std::streamsize>(content.size()));
  content.resize(static_cast<std::size_t>(std::cin.gcount()));
  if (content.size() > bytes_max) {
    throw ConfigError(key, shown(content), fmt::format("must be at most {} bytes long", bytes_max));
  }
  return content;
}

}  // namespace treeroll::worker
