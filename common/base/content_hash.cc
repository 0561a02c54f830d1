#include "common/base/content_hash.h"

#include <sodium.h>

#include <cstring>

#include "common/base/check.h"

namespace treeroll {

ContentHash content_hash(std::span<const std::byte> content) {
  ContentHash hash;
  const int status = crypto_generichash(hash.bytes.data(), hash.bytes.size(),
                                        reinterpret_cast<const unsigned char*>(content.data()),
                                        content.size(), nullptr, 0);
  CHECK(status == 0, "BLAKE2b refused a 16-byte hash");
  return hash;
}

ContentHash content_hash(std::string_view content) {
  return content_hash(std::as_bytes(std::span(content.data(), content.size())));
}

std::string to_hex(const ContentHash& hash) {
  std::string text(2 * hash.bytes.size() + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), hash.bytes.data(), hash.bytes.size());
  text.pop_back();
  return text;
}

std::int64_t short_form(const ContentHash& hash) {
  std::int64_t number = 0;
  std::memcpy(&number, hash.bytes.data(), sizeof number);
  return number;
}

}  // namespace treeroll
