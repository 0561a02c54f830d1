// Ten million datagrams, mutants of real ones and noise, against what reads them: no crash, no
// growth, and none that a holder of a key has not signed is taken. TREEROLL_DATAGRAMS: how many.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <set>
#include <string>

#include "common/transport/short_frame.h"
#include "common/transport/signature.h"
#include "tests/transport/message_maker.h"
#include "tests/transport/signing_side.h"

namespace treeroll::transport {
namespace {

constexpr std::int64_t kDatagrams = 10'000'000;
constexpr int kSeedsPerChannel = 40;
constexpr long kGrowthKbMax = 16 * 1024;

using Datagram = std::vector<std::byte>;

Datagram framed(const Signed& said) {
  Datagram datagram;
  const auto add = [&datagram](std::string_view text) {
    for (const char c : text) datagram.push_back(static_cast<std::byte>(c));
  };
  add("LC02");
  add(std::string(4, '\0'));
  add(channel_name(said.channel));
  datagram.push_back(std::byte{0});
  datagram.insert(datagram.end(), said.bytes.begin(), said.bytes.end());
  return datagram;
}

/// A real one, changed here and there as a stranger would, or nothing that anybody has said.
class Mutator {
 public:
  Mutator(std::vector<Datagram> seeds, std::uint64_t seed)
      : seeds_(std::move(seeds)), random_(seed) {}

  const Datagram& next() {
    const Datagram& seed = seeds_[below(seeds_.size())];
    made_ = seed;
    switch (below(10)) {
      case 0:  // noise, some of it behind a frame's first bytes
        made_.resize(below(2) == 0 ? 0 : std::min<std::size_t>(made_.size(), 8 + below(40)));
        for (std::size_t size = below(300); size > 0; --size) made_.push_back(any_byte());
        break;
      case 1:
        made_.resize(below(made_.size() + 1));
        break;
      case 2: {  // the head of one and the tail of another
        const Datagram& other = seeds_[below(seeds_.size())];
        const std::size_t cut = below(std::min(made_.size(), other.size()));
        std::copy(other.begin() + static_cast<std::ptrdiff_t>(cut), other.end(),
                  std::back_inserter((made_.resize(cut), made_)));
        break;
      }
      case 3:
        made_.insert(made_.begin() + static_cast<std::ptrdiff_t>(below(made_.size())), any_byte());
        break;
      default:
        for (std::size_t count = 1 + below(4); count > 0; --count) change();
    }
    return made_;
  }

 private:
  std::size_t below(std::size_t bound) { return random_() % std::max<std::size_t>(bound, 1); }
  std::byte any_byte() { return static_cast<std::byte>(random_()); }
  /// A bit, a byte, or a number that is an edge.
  void change() {
    if (made_.empty()) return;
    const std::size_t place = below(made_.size());
    switch (below(3)) {
      case 0:
        made_[place] ^= static_cast<std::byte>(1U << below(8));
        break;
      case 1:
        made_[place] = any_byte();
        break;
      default:
        constexpr std::array<unsigned char, 4> kEdges = {0, 0x7f, 0x80, 0xff};
        const auto edge = static_cast<std::byte>(kEdges.at(below(kEdges.size())));
        for (std::size_t i = place; i < std::min(made_.size(), place + 4); ++i) made_[i] = edge;
    }
  }

  std::vector<Datagram> seeds_;
  std::mt19937_64 random_;
  Datagram made_;
};

long resident_kb() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (long kb = 0; word == "VmRSS:" && status >> kb) return kb;
  }
  return 0;
}

std::int64_t num_datagrams() {
  const char* asked = std::getenv("TREEROLL_DATAGRAMS");
  return asked == nullptr ? kDatagrams : std::atoll(asked);
}

TEST(DatagramsLongTest, NoneCrashesNoneGrowsAndNoneIsTakenUnderAKey) {
  MetPair pair;
  MessageMaker maker(1);
  std::vector<Datagram> seeds;
  std::set<std::pair<Channel, std::vector<std::byte>>> originals;
  for (const Channel channel : kAllChannels) {
    for (int i = 0; i < kSeedsPerChannel; ++i) {
      protocol::Message message = maker.make(channel);
      std::visit(
          [](auto& m) {
            if constexpr (requires { m.worker_id; }) m.worker_id = kWorker;
            if constexpr (requires { m.learner_id; }) m.learner_id = kLearner;
          },
          message);
      Side& from = is_of_worker(channel) ? pair.worker : pair.learner;
      Side& to = is_of_worker(channel) ? pair.learner : pair.worker;
      const Signed said = from.say(message);
      to.hear(said);
      originals.emplace(said.channel, said.bytes);
      seeds.push_back(framed(said));
    }
  }
  Mutator mutator(std::move(seeds), 7);
  const std::int64_t count = num_datagrams();
  std::int64_t num_frames = 0;
  std::int64_t num_decoded = 0;
  std::int64_t num_repeated = 0;
  long kb_before = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    if (i == count / 10) kb_before = resident_kb();
    const Datagram& datagram = mutator.next();
    const std::optional<ShortFrame> frame = read_short_frame(datagram);
    if (!frame) continue;
    const auto channel = std::ranges::find_if(
        kAllChannels, [&](Channel each) { return channel_name(each) == frame->channel; });
    if (channel == kAllChannels.end()) continue;
    ++num_frames;
    num_decoded += decode(*channel, frame->payload) ? 1 : 0;
    const Signed heard{*channel, {frame->payload.begin(), frame->payload.end()}};
    if (originals.contains({heard.channel, heard.bytes})) {
      ++num_repeated;
      continue;
    }
    for (Side* side : {&pair.learner, &pair.worker}) {
      ASSERT_TRUE(side->authenticator.refusal(heard.channel, heard.bytes)) << "datagram " << i;
    }
  }
  std::printf(
      "  %lld datagrams: %lld frames of our channels, %lld decoded without keys, %lld as they "
      "were said, resident %ld kB, then %ld kB\n",
      static_cast<long long>(count), static_cast<long long>(num_frames),
      static_cast<long long>(num_decoded), static_cast<long long>(num_repeated), kb_before,
      resident_kb());
  EXPECT_GT(num_decoded, 0) << "else nothing past the first check was tried";
  EXPECT_LT(resident_kb() - kb_before, kGrowthKbMax);
}

}  // namespace
}  // namespace treeroll::transport
