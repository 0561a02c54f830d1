#include "common/base/for_log.h"

#include <algorithm>
#include <cstddef>
#include <nlohmann/json.hpp>

namespace treeroll {
namespace {

using nlohmann::json;

constexpr std::size_t kLogLineBytesMax = 500;

}  // namespace

std::string for_log(std::string_view line) {
  const std::string quoted =
      json(line.substr(0, kLogLineBytesMax)).dump(-1, ' ', false, json::error_handler_t::replace);
  std::string text = json::parse(quoted).get<std::string>();
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' ' || c == 0x7f; }, ' ');
  // C1 controls, two bytes in UTF-8: some terminals obey them too.
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    const bool is_control = static_cast<unsigned char>(text[i]) == 0xc2 &&
                            static_cast<unsigned char>(text[i + 1]) < 0xa0;
    if (is_control) text.replace(i, 2, " ");
  }
  return text;
}

}  // namespace treeroll
