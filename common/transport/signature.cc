#include "common/transport/signature.h"

#include <sodium.h>

#include <algorithm>
#include <cstring>

#include "common/base/check.h"

namespace treeroll::transport {
namespace {

using protocol::kFingerprintBytes;
using protocol::kMacBytes;
using protocol::kSignatureBytes;

const unsigned char* raw(const std::byte* bytes) {
  return reinterpret_cast<const unsigned char*>(bytes);
}

std::int64_t number_at(Bytes bytes, std::size_t at) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < 8; ++i)
    number = number << 8 | std::to_integer<unsigned>(bytes[at + i]);
  return static_cast<std::int64_t>(number);
}

class Hash {
 public:
  /// @param key  null: none
  Hash(const Key* key, std::size_t size) : size_(size) {
    CHECK(crypto_generichash_init(&state_, key ? key->data() : nullptr, key ? key->size() : 0,
                                  size) == 0,
          "BLAKE2b refuses a key of 32 bytes");
  }
  Hash& add(Bytes bytes) {
    crypto_generichash_update(&state_, raw(bytes.data()), bytes.size());
    return *this;
  }
  Hash& add(const char* text_with_nul) {
    crypto_generichash_update(&state_, reinterpret_cast<const unsigned char*>(text_with_nul),
                              std::strlen(text_with_nul) + 1);
    return *this;
  }
  void write(unsigned char* to) { crypto_generichash_final(&state_, to, size_); }

 private:
  crypto_generichash_state state_;
  std::size_t size_;
};

}  // namespace

void put_number(std::byte* at, std::int64_t number, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) {
    at[i] = static_cast<std::byte>(static_cast<std::uint64_t>(number) >> (8 * (size - 1 - i)));
  }
}

std::int64_t sender_in(Bytes bytes) { return number_at(bytes, kFingerprintBytes); }
std::int64_t key_id_in(Bytes bytes) { return number_at(bytes, bytes.size() - kSignatureBytes); }
std::int64_t index_in(Bytes bytes) { return number_at(bytes, bytes.size() - kSignatureBytes + 8); }
Bytes mac_in(Bytes bytes) { return bytes.last(kMacBytes); }

bool is_of_worker(Channel channel) {
  return channel == Channel::kRewardBatch || channel == Channel::kWorkerStatus ||
         channel == Channel::kDefinitionRequest || channel == Channel::kDefinitionReport;
}

Mac mac_of(const Key& key, Channel channel, Bytes bytes) {
  Mac mac{};
  Hash(&key, mac.size())
      .add(channel_name(channel))
      .add(bytes.first(bytes.size() - kMacBytes))
      .write(mac.data());
  return mac;
}

bool is_mac(Bytes given, const Mac& mac) {
  return sodium_memcmp(given.data(), mac.data(), mac.size()) == 0;
}

std::vector<std::int64_t> named_in(const protocol::RolloutBatch& batch) {
  std::vector<std::int64_t> named;
  named.reserve(batch.rollouts.size() + batch.acknowledgements.size());
  for (const auto& request : batch.rollouts) named.push_back(request.worker_id);
  for (const auto& word : batch.acknowledgements) named.push_back(word.worker_id);
  std::sort(named.begin(), named.end());
  named.erase(std::unique(named.begin(), named.end()), named.end());
  return named;
}

Digest digest_of(Bytes bytes, std::size_t num_words) {
  const std::size_t tail = kSignatureBytes + protocol::kWordMacBytes * num_words + 4;
  Digest digest{};
  Hash(nullptr, digest.size())
      .add(channel_name(Channel::kRolloutBatch))
      .add(bytes.first(bytes.size() - tail))
      .add(bytes.subspan(bytes.size() - kSignatureBytes + 8, 8))
      .write(reinterpret_cast<unsigned char*>(digest.data()));
  return digest;
}

Mac word_mac(const Key& key, const Digest& digest) {
  Mac mac{};
  Hash(&key, mac.size()).add(digest).write(mac.data());
  return mac;
}

}  // namespace treeroll::transport
