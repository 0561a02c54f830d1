#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace treeroll {

/// Name of a content: the first 128 bits of its BLAKE2b hash. Equal contents have equal names on
/// every machine; two different contents with one name are not to be expected.
struct ContentHash {
  std::array<std::uint8_t, 16> bytes{};
  auto operator<=>(const ContentHash&) const = default;
};

ContentHash content_hash(std::span<const std::byte> content);
ContentHash content_hash(std::string_view content);

/// 32 lower-case hexadecimal digits.
std::string to_hex(const ContentHash& hash);

/// The first eight bytes as a number, for places where a short check is enough.
std::int64_t short_form(const ContentHash& hash);

}  // namespace treeroll
