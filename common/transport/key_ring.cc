#include "common/transport/key_ring.h"

#include <fmt/format.h>
#include <sodium.h>

#include <algorithm>
#include <optional>

#include "common/base/check.h"

namespace treeroll::transport {
namespace {

constexpr std::string_view kLearnerWord = "learner";
constexpr std::string_view kWorkerWord = "worker";

std::string hex(const unsigned char* bytes, std::size_t size) {
  std::string text(2 * size + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), bytes, size);
  text.pop_back();
  return text;
}

bool read_hex(std::string_view text, unsigned char* bytes, std::size_t size) {
  std::size_t num_read = 0;
  const char* end = nullptr;
  return text.size() == 2 * size &&
         sodium_hex2bin(bytes, size, text.data(), text.size(), nullptr, &num_read, &end) == 0 &&
         num_read == size && end == text.data() + text.size();
}

std::array<unsigned char, 8> big_endian(std::int64_t number) {
  std::array<unsigned char, 8> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes.at(i) = static_cast<unsigned char>(static_cast<std::uint64_t>(number) >> (56 - 8 * i));
  }
  return bytes;
}

/// Positive, as ids are.
std::int64_t positive_number(const unsigned char* bytes) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < 8; ++i) number = number << 8 | bytes[i];
  return static_cast<std::int64_t>(number >> 1) | 1;
}

Key derived(const Key& from, std::string_view purpose, const unsigned char* more,
            std::size_t more_bytes) {
  Key key{};
  crypto_generichash_state state;
  CHECK(crypto_generichash_init(&state, from.data(), from.size(), key.size()) == 0,
        "BLAKE2b refuses a key of 32 bytes");
  crypto_generichash_update(&state, reinterpret_cast<const unsigned char*>(purpose.data()),
                            purpose.size());
  crypto_generichash_update(&state, more, more_bytes);
  crypto_generichash_final(&state, key.data(), key.size());
  return key;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  line = line.substr(0, line.find('#'));
  constexpr std::string_view kBlanks = " \t\r";
  while (true) {
    const std::size_t begin = line.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos) return words;
    line.remove_prefix(begin);
    const std::size_t end = std::min(line.find_first_of(kBlanks), line.size());
    words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

std::optional<WorkerKey> read_worker(const std::vector<std::string_view>& words) {
  WorkerKey key;
  std::array<unsigned char, 8> id{};
  if (words.size() != 4 || !read_hex(words[1], id.data(), id.size()) ||
      !read_hex(words[2], key.own.data(), key.own.size()) ||
      !read_hex(words[3], key.announcements.data(), key.announcements.size())) {
    return std::nullopt;
  }
  std::uint64_t number = 0;
  for (const unsigned char byte : id) number = number << 8 | byte;
  key.id = static_cast<std::int64_t>(number);
  if (key.id <= 0) return std::nullopt;
  return key;
}

}  // namespace

Result<KeyRing> KeyRing::parse(std::string_view text) {
  KeyRing ring;
  // Of a line that is wrong nothing is shown: it may be a secret with a slip.
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::vector<std::string_view> words = words_of(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words.empty()) continue;
    Key key{};
    if (words[0] == kLearnerWord && words.size() == 2 &&
        read_hex(words[1], key.data(), key.size())) {
      ring.learner_keys_.push_back(key);
    } else if (const auto worker = read_worker(words); worker && words[0] == kWorkerWord) {
      ring.worker_keys_.push_back(*worker);
    } else {
      return Error{
          fmt::format("line {}: must be \"learner KEY\" or \"worker ID KEY KEY\", as "
                      "treeroll-keygen writes them",
                      number)};
    }
  }
  if (ring.learner_keys_.empty() && ring.worker_keys_.empty()) return Error{"holds no key"};
  if (!ring.learner_keys_.empty() && !ring.worker_keys_.empty()) {
    return Error{"holds keys of learners and of workers: must be those of one"};
  }
  const auto is_of_another = [&](const WorkerKey& key) {
    return key.id != ring.worker_keys_.front().id;
  };
  if (std::any_of(ring.worker_keys_.begin(), ring.worker_keys_.end(), is_of_another)) {
    return Error{"holds keys of two workers: must be those of one (--same-worker-as)"};
  }
  if (ring.learner_keys_.size() + ring.worker_keys_.size() > kKeysPerRingMax) {
    return Error{fmt::format("holds more than {} keys", kKeysPerRingMax)};
  }
  return ring;
}

std::int64_t KeyRing::worker_id(std::int64_t random) const {
  if (is_learners()) return random;  // and its key has the same id
  constexpr std::int64_t kOwn = (std::int64_t{1} << 39U) - 1;
  return (worker_keys_.front().id & ~kOwn) | (random & kOwn);
}

Key announcement_key(const Key& learner) {
  return derived(learner, "treeroll announcements", nullptr, 0);
}

WorkerKey worker_key(const Key& learner, std::int64_t id) {
  const std::array<unsigned char, 8> bytes = big_endian(id);
  return {id, derived(learner, "treeroll worker", bytes.data(), bytes.size()),
          announcement_key(learner)};
}

std::int64_t announcement_id(const Key& announcements) {
  return positive_number(derived(announcements, "treeroll key", nullptr, 0).data());
}

std::string line_of(const Key& learner) {
  return fmt::format("{} {}", kLearnerWord, hex(learner.data(), learner.size()));
}

std::string line_of(const WorkerKey& worker) {
  const std::array<unsigned char, 8> id = big_endian(worker.id);
  return fmt::format("{} {} {} {}", kWorkerWord, hex(id.data(), id.size()),
                     hex(worker.own.data(), worker.own.size()),
                     hex(worker.announcements.data(), worker.announcements.size()));
}

}  // namespace treeroll::transport
