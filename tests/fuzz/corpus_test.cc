// Every seed of the corpora, and inputs made of them at random: what the readers of outside bytes
// must survive in each run. Fuzzing proper, which looks where code has not been yet, is
// deploy/fuzz.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/target.h"

namespace treeroll::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr int kNumMutants = 20'000;

std::vector<std::string> seeds_of(const std::string& name) {
  std::vector<fs::path> paths;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(fs::path(TREEROLL_CORPUS_DIR) / name)) {
    paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<std::string> seeds;
  for (const fs::path& path : paths) {
    std::ifstream file(path, std::ios::binary);
    seeds.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return seeds;
}

/// A few changes of those that break readers: bits, numbers at their limits, parts cut out, doubled
/// and taken from another seed.
class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  std::string mutant(const std::vector<std::string>& seeds) {
    std::string text = seeds[below(seeds.size())];
    for (std::size_t changes = 1 + below(4); changes > 0; --changes) change(text, seeds);
    return text;
  }

 private:
  std::size_t below(std::size_t bound) { return random_() % bound; }

  void change(std::string& text, const std::vector<std::string>& seeds) {
    static const std::vector<std::string> kWords = {"-1",
                                                    "0",
                                                    "1e308",
                                                    "1e400",
                                                    "nan",
                                                    "-inf",
                                                    "9223372036854775808",
                                                    "[",
                                                    "{",
                                                    "\"",
                                                    "\\u0000",
                                                    std::string(1, '\0'),
                                                    std::string(8, '\xff'),
                                                    std::string("\x7f\xff\xff\xff", 4),
                                                    "\n",
                                                    "\xc3\x28"};
    const std::size_t at = below(text.size() + 1);
    const std::size_t size = std::min(text.size() - at, below(32));
    switch (below(6)) {
      case 0:
        if (at < text.size()) text[at] = static_cast<char>(text[at] ^ (1 << below(8)));
        break;
      case 1:
        text.replace(at, size, kWords[below(kWords.size())]);
        break;
      case 2:
        text.erase(at, size);
        break;
      case 3:
        text.insert(at, text.substr(at, size));
        break;
      case 4:
        text.resize(at);
        break;
      default: {
        const std::string& other = seeds[below(seeds.size())];
        const std::size_t from = below(other.size() + 1);
        text.replace(at, size, other.substr(from, below(200)));
      }
    }
  }

  std::mt19937_64 random_;
};

class CorpusTest : public testing::TestWithParam<Target> {};

INSTANTIATE_TEST_SUITE_P(Targets, CorpusTest, testing::ValuesIn(targets().begin(), targets().end()),
                         [](const auto& each) { return std::string(each.param.name); });

TEST_P(CorpusTest, IsTakenOrRefused) {
  const std::vector<std::string> seeds = seeds_of(GetParam().name);
  int num_taken = 0;
  for (const std::string& seed : seeds) num_taken += GetParam().run(seed) ? 1 : 0;
  EXPECT_GT(num_taken, 0) << "seeds that are all refused lead nowhere";
  const char* fresh = std::getenv("TREEROLL_SIMULATION_FRESH");
  Mutator mutator(fresh != nullptr ? std::strtoull(fresh, nullptr, 10) : 1);
  for (int i = 0; i < kNumMutants; ++i) GetParam().run(mutator.mutant(seeds));
}

}  // namespace
}  // namespace treeroll::fuzz
