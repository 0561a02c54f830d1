#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/protocol/messages.h"
#include "common/protocol/wire_sizes.h"
#include "common/transport/channel.h"
#include "common/transport/key_ring.h"

/// Where the signature of a message lies in its bytes, and what is signed: lcmtypes/PROTOCOL.md.
/// Pure; who may sign what is the Authenticator's business.
namespace treeroll::transport {

using Bytes = std::span<const std::byte>;
using Mac = std::array<unsigned char, protocol::kMacBytes>;
using Digest = std::array<std::byte, 32>;

// Every message begins with its fingerprint and its sender, and ends with its signature: the id of
// the key, the index, the authentication code. Precondition: the bytes have room for these.
std::int64_t sender_in(Bytes bytes);
std::int64_t key_id_in(Bytes bytes);
std::int64_t index_in(Bytes bytes);
Bytes mac_in(Bytes bytes);
/// Writes the last `size` bytes of a number, as LCM does: the most significant first.
void put_number(std::byte* at, std::int64_t number, std::size_t size);

/// Else a learner says it.
bool is_of_worker(Channel channel);

/// Of all bytes before the authentication code, for a channel.
Mac mac_of(const Key& key, Channel channel, Bytes bytes);
/// In constant time.
bool is_mac(Bytes given, const Mac& mac);

/// Those whom a batch names, by ascending id.
std::vector<std::int64_t> named_in(const protocol::RolloutBatch& batch);
/// Of a batch and its index, but for the authentication codes in it: what the word to each worker
/// is signed over.
Digest digest_of(Bytes bytes, std::size_t num_words);
Mac word_mac(const Key& key, const Digest& digest);

}  // namespace treeroll::transport
