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
        Promise{"hold", "55543c084d91b0b2e8a347db1549229e", "b5b10b462b991f982a587bb598f004ff"},
        Promise{"spiral", "1566caa29e40afb148e33d9c6ec22337", "ea4d22aae44fae50dddddabed396a5d3"},
        Promise{"swing_up", "e1967a3927cb41cfc6ab76b4f6f45c61", "d535b60f94c0f763d2419526d1bc573c", true},
        Promise{"swing_up_rules", "4dfab0e0ff541252a407e7076df87f43", "e55ef720e4fac564875cc281f5f96cdf"},
        Promise{"thesis_4_1", "483d13d484ecef014b386ba37bfbbc34", "f964f019f5588cabba6779dc95d31315"},
        Promise{"thesis_4_1_initial_noise", "c31c0211484b247f3c9d9e2746273c67", "2e09fb5c5b9c4785bae0ae35193d642f"},
        Promise{"thesis_4_1_minimum_noise", "7292ce3d68700aee8a26116f85bd96ca", "906943bd083e3afb9d260321be5a80b3"},
        Promise{"thesis_4_1_reuse", "a5f957d97f34997da8e369cc8630783b", "ea37210cd2f9d0dfbb5915ec194ecd7a"},
        Promise{"thesis_4_2", "48ca7dafa33b84953efae447e8cda9d4", "f1f9d31357c806b82dcd0fabd95f60cf"},
        Promise{"thesis_4_2_initial_noise", "a59b761a51551f255671bb099e9e1576", "32e64200bee40ee5bcb57300fc92d185"},
        Promise{"thesis_4_2_minimum_noise", "c137e9ccb570c56965432ab228f14962", "3cd27d3dba1bacdc42a67dbbc2bbad2b"},
        Promise{"thesis_4_3", "5c70657ee96e1a352e61a4fc22f4d2cc", "a88411e46cf1d13e3761a6d6812a7829", true},
        Promise{"thesis_frames", "e78ac053bb1b2496bb1ecd79b5459802", "1ab2249bc51e32cbb583b6095e3eb814"},
        Promise{"thesis_window", "09e28c52dd5678cf08e1655c7ea4078a", "bb101d1d90009e9b574e3a9d65bdaccb"}  // clang-format on
        ),
    [](const auto& info) { return info.param.study; });

}  // namespace
}  // namespace treeroll
