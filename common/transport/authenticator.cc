#include "common/transport/authenticator.h"

#include <fmt/format.h>
#include <sodium.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "common/base/check.h"
#include "common/protocol/limits.h"
#include "common/protocol/wire_sizes.h"
#include "common/transport/signature.h"

namespace treeroll::transport {
namespace {

using protocol::kFingerprintBytes;
using protocol::kMacBytes;
using protocol::kSignatureBytes;

/// Of all that are remembered; the one that has been silent longest goes, first of those that have
/// proved nothing.
constexpr std::size_t kSendersMax = 4 * protocol::kWorkersMax;
/// Of the names that one worker's key may sign for: a stolen one pushes out no others.
constexpr std::size_t kSendersPerKeyMax = protocol::kWorkersMax;
/// Names that one process has had: a relay has one for each learner that it has served.
constexpr std::size_t kOwnNamesMax = 1024;

}  // namespace

Authenticator::Authenticator(KeyRing keys, bool only_watches, std::int64_t last_index)
    : only_watches_(only_watches), last_index_(last_index) {
  CHECK(sodium_init() >= 0, "libsodium does not start");  // it finds the fastest BLAKE2b here
  set_keys(std::move(keys));
}

void Authenticator::set_keys(KeyRing keys) {
  if (keys == keys_) return;  // its file was only touched
  keys_ = std::move(keys);
  announcements_.clear();
  for (const Key& key : keys_.learner_keys()) announcements_.push_back({0, announcement_key(key)});
  for (const WorkerKey& key : keys_.worker_keys()) announcements_.push_back({0, key.announcements});
  for (Announcements& one : announcements_) one.id = announcement_id(one.key);
  for (auto& [id, known] : senders_) {
    if (!known.key) continue;
    const WorkerKey key = *known.key;
    const bool follows = std::ranges::any_of(keys_.learner_keys(), [&key](const Key& learner) {
      return worker_key(learner, key.id) == key;
    });
    if (follows) continue;
    // Its worker takes the words of this one before it signs with it.
    known.key = keys_.is_learners()
                    ? std::optional(worker_key(keys_.learner_keys().front(), key.id))
                    : std::nullopt;
  }
  own_keys_.clear();
}

const WorkerKey* Authenticator::key_of(SenderId worker) const {
  const auto known = senders_.find(worker);
  return known != senders_.end() && known->second.key ? &*known->second.key : nullptr;
}

/// Of a worker of ours: the first signs.
const std::vector<WorkerKey>& Authenticator::own_keys(SenderId worker) {
  if (!keys_.is_learners()) return keys_.worker_keys();
  std::vector<WorkerKey>& keys = own_keys_[worker];
  if (keys.empty()) {
    for (const Key& key : keys_.learner_keys()) keys.push_back(worker_key(key, worker));
  }
  return keys;
}

void Authenticator::note_own(SenderId id, bool as_worker) {
  if (!own_.try_emplace(id, as_worker).second) return;
  own_row_.push_back(id);
  if (own_row_.size() <= kOwnNamesMax) return;
  own_.erase(own_row_.front());
  own_keys_.erase(own_row_.front());
  own_row_.pop_front();
}

/// Whom a newcomer of this name replaces, if anybody: where its key has names enough, one of these.
std::map<Authenticator::SenderId, Authenticator::Sender>::iterator Authenticator::to_put_out(
    SenderId for_whom) {
  const auto [first, last] = names_of_one_key(for_whom);
  auto begin = senders_.lower_bound(first);
  auto end = senders_.upper_bound(last);
  if (static_cast<std::size_t>(std::distance(begin, end)) < kSendersPerKeyMax) {
    if (senders_.size() < kSendersMax) return senders_.end();
    begin = senders_.begin();
    end = senders_.end();
  }
  return std::min_element(begin, end, [](const auto& a, const auto& b) {
    return std::pair(a.second.window.has_value(), a.second.heard) <
           std::pair(b.second.window.has_value(), b.second.heard);
  });
}

Authenticator::Sender& Authenticator::sender(SenderId id) {
  auto found = senders_.find(id);
  if (found == senders_.end()) {
    const auto victim = to_put_out(id);
    if (victim != senders_.end()) senders_.erase(victim);
    found = senders_.try_emplace(id).first;
  }
  found->second.heard = ++num_heard_;
  return found->second;
}

void Authenticator::sign(const protocol::Message& message, std::vector<std::byte>& bytes) {
  const Channel channel = channel_of(message);
  const SenderId self = sender_in(bytes);
  const bool as_worker = is_of_worker(channel);
  note_own(self, as_worker);
  CHECK(as_worker || keys_.is_learners(), "a worker's key speaks as a learner");
  std::vector<std::int64_t> named;
  if (const auto* batch = std::get_if<protocol::RolloutBatch>(&message)) named = named_in(*batch);
  if (!named.empty()) {
    const std::size_t at = bytes.size() - kSignatureBytes;
    put_number(&bytes[at - 4], static_cast<std::int64_t>(named.size()), 4);
    bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                 protocol::kWordMacBytes * named.size(), std::byte{0});
  }
  const WorkerKey* own = as_worker ? &own_keys(self).front() : nullptr;
  std::byte* const signature = bytes.data() + bytes.size() - kSignatureBytes;
  put_number(signature, own ? own->id : announcements_.front().id, 8);
  put_number(signature + 8, ++last_index_, 8);
  if (!named.empty()) {
    const auto digest = digest_of(bytes, named.size());
    std::byte* word = signature - protocol::kWordMacBytes * named.size();
    for (const std::int64_t worker : named) {
      // Of one that has not been heard nothing is known; it cannot have been asked for anything.
      if (const WorkerKey* key = key_of(worker)) {
        const Mac mac = word_mac(key->own, digest);
        std::memcpy(word, mac.data(), mac.size());
      }
      word += protocol::kWordMacBytes;
    }
  }
  const Mac mac = mac_of(own ? own->own : announcements_.front().key, channel, bytes);
  std::memcpy(signature + 16, mac.data(), mac.size());
}

std::optional<std::string> Authenticator::refusal(Channel channel, Bytes bytes) {
  const auto because = [channel](const std::string& why) {
    return fmt::format("{}: {}", channel_name(channel), why);
  };
  if (bytes.size() < kFingerprintBytes + 8 + kSignatureBytes) return because("is too short");
  if (index_in(bytes) <= 0) {
    return because(fmt::format(
        "{} {} signs nothing: it runs without --key-file, or is of another version of treeroll",
        is_of_worker(channel) ? "worker" : "learner", sender_in(bytes)));
  }
  if (is_of_worker(channel)) return refusal_of_worker(channel, bytes);
  const auto known =
      std::find_if(announcements_.begin(), announcements_.end(),
                   [&](const Announcements& one) { return one.id == key_id_in(bytes); });
  if (known == announcements_.end()) {
    return because(
        fmt::format("learner {} signs with a key that is not in our key file", sender_in(bytes)));
  }
  if (is_mac(mac_in(bytes), mac_of(known->key, channel, bytes))) return std::nullopt;
  return because("is not what it was signed as: forged, or damaged");
}

std::optional<std::string> Authenticator::refusal_of_worker(Channel channel, Bytes bytes) {
  const std::int64_t key_id = key_id_in(bytes);
  const SenderId worker = sender_in(bytes);
  if (!may_sign_for(key_id, worker)) {
    return fmt::format("{}: somebody with another key, or none, speaks in the name of worker {}",
                       channel_name(channel), worker);
  }
  if (const WorkerKey* key = key_of(worker);
      key && key->id == key_id && is_mac(mac_in(bytes), mac_of(key->own, channel, bytes))) {
    return std::nullopt;
  }
  for (const Key& learner : keys_.learner_keys()) {
    const WorkerKey key = worker_key(learner, key_id);
    if (!is_mac(mac_in(bytes), mac_of(key.own, channel, bytes))) continue;
    sender(worker).key = key;
    return std::nullopt;
  }
  return fmt::format(
      "{}: worker {} signs with a key that does not follow from ours, or it is "
      "forged",
      channel_name(channel), worker);
}

bool Authenticator::names_us(const protocol::Message& message) const {
  const auto is_ours = [this](const auto& part) {
    if constexpr (requires { part.worker_id; }) {
      return is_own(part.worker_id);
    } else {
      return part.last_batch > 0 && is_own(part.learner_id);
    }
  };
  if (const auto* batch = std::get_if<protocol::RolloutBatch>(&message)) {
    return std::any_of(batch->rollouts.begin(), batch->rollouts.end(), is_ours) ||
           std::any_of(batch->acknowledgements.begin(), batch->acknowledgements.end(), is_ours);
  }
  if (const auto* status = std::get_if<protocol::WorkerStatus>(&message)) {
    return std::any_of(status->held.begin(), status->held.end(), is_ours);
  }
  if (const auto* answers = std::get_if<protocol::RewardBatch>(&message)) {
    return is_own(answers->learner_id);
  }
  if (const auto* request = std::get_if<protocol::DefinitionRequest>(&message)) {
    return is_own(request->learner_id);
  }
  const auto* report = std::get_if<protocol::DefinitionReport>(&message);
  return report && is_own(report->learner_id);
}

/// Whether each of us that it names is named by who has that one's key.
bool Authenticator::words_are_right(const protocol::RolloutBatch& batch, Bytes bytes) {
  const std::vector<std::int64_t> named = named_in(batch);
  const std::size_t words_bytes = protocol::kWordMacBytes * named.size();
  const Bytes before = bytes.first(bytes.size() - kSignatureBytes);
  if (before.size() < words_bytes + 4) return false;
  const Bytes count = before.first(before.size() - words_bytes).last(4);
  std::array<std::byte, 4> expected{};
  put_number(expected.data(), static_cast<std::int64_t>(named.size()), 4);
  if (!std::equal(count.begin(), count.end(), expected.begin())) return false;
  const auto digest = digest_of(bytes, named.size());
  for (std::size_t i = 0; i < named.size(); ++i) {
    if (!is_own(named[i])) continue;
    const Bytes word = before.last(words_bytes).subspan(protocol::kWordMacBytes * i, kMacBytes);
    const std::vector<WorkerKey>& keys = own_keys(named[i]);
    if (std::none_of(keys.begin(), keys.end(), [&](const WorkerKey& key) {
          return is_mac(word, word_mac(key.own, digest));
        })) {
      return false;
    }
  }
  return true;
}

/// A batch that is signed for us, too: its index is this learner's, whatever others have said in
/// its name with the key that they share. Where they have run ahead of it what it says to all
/// counts from here again.
Authenticator::Admission Authenticator::admit_word(SenderId from, std::int64_t index) {
  Sender& live = sender(from);
  if (!live.words) live.words.emplace(index);
  if (!live.words->take(index)) return Admission::kReplayed;
  if (!live.window || live.window->highest() >= index + ReplayWindow::kSize) {
    live.window.emplace(index);
  }
  live.window->take(index);
  return Admission::kTaken;
}

Authenticator::Admission Authenticator::admit(const protocol::Message& message, Bytes bytes) {
  const SenderId from = sender_in(bytes);
  // Our own, come back. What learners say to all others can sign too, so they could speak as a
  // learner of a worker's name, which nobody has given a key for that.
  if (const auto own = own_.find(from); own != own_.end()) {
    const bool as_worker = is_of_worker(channel_of(message));
    return own->second == as_worker && index_in(bytes) <= last_index_ ? Admission::kTaken
                                                                      : Admission::kForged;
  }
  const bool is_for_us = names_us(message);
  const auto* batch = std::get_if<protocol::RolloutBatch>(&message);
  if (is_for_us && batch) {
    return words_are_right(*batch, bytes) ? admit_word(from, index_in(bytes)) : Admission::kForged;
  }
  const auto known = senders_.find(from);
  const bool is_proven = known != senders_.end() && known->second.window;
  if (is_proven || is_for_us || only_watches_) {
    Sender& live = sender(from);
    if (!live.window) live.window.emplace(index_in(bytes));
    return live.window->take(index_in(bytes)) ? Admission::kTaken : Admission::kReplayed;
  }
  const bool is_hello = std::holds_alternative<protocol::WorkerStatus>(message) ||
                        std::holds_alternative<protocol::LearnerStatus>(message);
  return is_hello ? Admission::kTaken : Admission::kUnproven;
}

}  // namespace treeroll::transport
