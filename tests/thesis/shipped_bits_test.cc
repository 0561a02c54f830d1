#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "common/base/content_hash.h"
#include "common/files/whole_file.h"
#include "learner/results/csv.h"
#include "tests/thesis/run_study.h"
#include "workers/app/host_facts.h"

/// The bits of the shipped studies are a promise: what changes them is said in its commit, with the
/// reason, and only then are the digests below taken anew (a failure prints the new ones).
namespace treeroll {
namespace {

/// Results of a shipped study at one repetition.
struct Promise {
  std::string study;
  std::string rollouts;  ///< content_hash() of rollouts.csv
  std::string runs;      ///< of runs.csv
  /// ODE's steps have the same bits on machines of one numeric class alone.
  bool uses_ode = false;
};

constexpr const char* kClassOfOde = "x86_64 fma avx2 glibc 2.36";

void PrintTo(const Promise& promise, std::ostream* out) { *out << promise.study; }

class ShippedBitsTest : public ::testing::TestWithParam<Promise> {};

std::string digest(const std::filesystem::path& file) {
  return to_hex(content_hash(read_whole_file(file)));
}

TEST_P(ShippedBitsTest, AreWhatTheyWere) {
  const Promise& promise = GetParam();
  if (promise.uses_ode && worker::numeric_class() != kClassOfOde) {
    GTEST_SKIP() << "its bits are promised for " << kClassOfOde;
  }
  const std::vector<RunRecord> runs =
      run_study(std::filesystem::path(TREEROLL_STUDIES_DIR) / (promise.study + ".toml"),
                {"study.repetitions=1"});
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("shipped_bits_" + promise.study);
  std::filesystem::create_directories(folder);
  write_rollouts_csv(folder / "rollouts.csv", runs);
  write_runs_csv(folder / "runs.csv", runs);
  EXPECT_EQ(digest(folder / "rollouts.csv"), promise.rollouts);
  EXPECT_EQ(digest(folder / "runs.csv"), promise.runs);
  std::filesystem::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(
    Studies, ShippedBitsTest,
    ::testing::Values(
        // clang-format off
        Promise{"hold", "f284d4c01890dde9c67e91af8f995ea0", "34349dbd67504fa8cf59f415a502c430"},
        Promise{"spiral", "915f965c9ca2058ecd024cdaffaf2828", "1b0a07207bb5b16914832f0ca4b1fb55"},
        Promise{"swing_up", "5f3b1964faad5e32fc7113f377faf33e", "21aee433316d323f2d8cde56b9bb0919", true},
        Promise{"swing_up_rules", "4d13288b6b2dfbeda3a6df7314b0a96a", "816d629aaab10461692453513cb90733"},
        Promise{"thesis_4_1", "10926966740c1ed1ae31ec525bd086ac", "c85f9ef4488f5220dffbbcef64beb39d"},
        Promise{"thesis_4_1_initial_noise", "b5f914a5dcb0a9b54147ab3b482f869f", "2508cb6ce739101b4ed7bb8a45531a2c"},
        Promise{"thesis_4_1_minimum_noise", "34b674539da1a9d9f9c7e0ad125b0b67", "2b7c68f824f0c0979d9d44739b1988fe"},
        Promise{"thesis_4_1_reuse", "e404c6143028d1259d3d7d67bfc40add", "d09309dcc210fc5c4061c2acbd796598"},
        Promise{"thesis_4_2", "1e5e019fc734e416148d0893cb0dd8bf", "51130cf5ff8a68d95018cb07830d1e4f"},
        Promise{"thesis_4_2_initial_noise", "8a78d8e65f951cbfa34c28fe617b3782", "afd1cfdce288c2201947d17f019158cd"},
        Promise{"thesis_4_2_minimum_noise", "4191c701ab51e188ea81c48b9a16a072", "f30132bd3db648b300456890fc4a9f00"},
        Promise{"thesis_4_3", "a41b22f71307e63200135f55c911f8cc", "bec99288e3418008cb8f5a9ee647bd51", true},
        Promise{"thesis_frames", "94991cfce7b029458697751011c80a3a", "52932cd85255766285f4ee3e52f24602"},
        Promise{"thesis_window", "a5f2c71fbc0b4f5fccbd6ae70a1650d6", "0793d9b52ff9a923a0019da382ed1cbe"}  // clang-format on
        ),
    [](const auto& info) { return info.param.study; });

}  // namespace
}  // namespace treeroll
