#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/content_hash.h"
#include "common/files/whole_file.h"
#include "learner/results/csv.h"
#include "tests/thesis/chosen_lanes.h"
#include "tests/thesis/run_study.h"
#include "workers/app/host_facts.h"

/// The bits of the shipped studies are a promise: what changes them is said in its commit, with the
/// reason, and only then are the digests below taken anew (a failure prints the new ones). They
/// hold for every number of lanes, and whichever roll-outs are computed side by side.
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

constexpr const char* kClassOfOde = "x86_64 fma avx2 glibc 2.36 elementary 2";

void PrintTo(const Promise& promise, std::ostream* out) { *out << promise.study; }

class ShippedBitsTest : public ::testing::TestWithParam<Promise> {};

std::string digest(const std::filesystem::path& file) {
  return to_hex(content_hash(read_whole_file(file)));
}

/// The narrowest and the widest; a plant of ODE is simulated alone at any width, so the widest
/// does. TREEROLL_LANES=all asks for every width.
std::vector<int> widths(const Promise& promise) {
  const std::vector<int> all = test::lane_widths();
  const char* asked = std::getenv("TREEROLL_LANES");
  if (asked != nullptr && std::string_view(asked) == "all") return all;
  if (promise.uses_ode || all.size() == 1) return {all.back()};
  return {all.front(), all.back()};
}

TEST_P(ShippedBitsTest, AreWhatTheyWere) {
  const Promise& promise = GetParam();
  if (promise.uses_ode && worker::numeric_class() != kClassOfOde) {
    GTEST_SKIP() << "its bits are promised for " << kClassOfOde;
  }
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("shipped_bits_" + promise.study);
  std::filesystem::create_directories(folder);
  for (const int width : widths(promise)) {
    SCOPED_TRACE(fmt::format("{} lanes", width));
    test::choose_lanes(width);
    const std::vector<RunRecord> runs =
        run_study(std::filesystem::path(TREEROLL_STUDIES_DIR) / (promise.study + ".toml"),
                  {"study.repetitions=1"});
    write_rollouts_csv(folder / "rollouts.csv", runs);
    write_runs_csv(folder / "runs.csv", runs);
    EXPECT_EQ(digest(folder / "rollouts.csv"), promise.rollouts);
    EXPECT_EQ(digest(folder / "runs.csv"), promise.runs);
  }
  std::filesystem::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(
    Studies, ShippedBitsTest,
    ::testing::Values(
        // clang-format off
        Promise{"biased_demonstration", "65c6584b1501492a272ead8ade79085f", "4ae364bc8ebef32582f9a796cb902d7b"},
        Promise{"hold", "4389daa6f2c63e1595446bb80aff87ac", "394a7c95f10847c4a82d78b60cd593a2"},
        Promise{"hold_untuned", "9f3efcef2f41cb978f3a11c80cf1ef86", "1e91734cd34b410491ce8b8862ce5f2c"},
        Promise{"spiral", "b3ebb12a7494138220501d332d49e1c1", "cd913ca11cb876c36da793391acf4d1a"},
        Promise{"swing_up", "01e01b44e57cc8016c899be90e3d59c9", "88cd08e9dd46df59a71657f5a6d7f3d1", true},
        Promise{"swing_up_rules", "b238e460f1863bb64ec69cca2da11ec7", "3afdff4a317c3def67c524e30497e702"},
        Promise{"swing_up_and_hold", "37aaaf9d1ef3a8e8ded78b755ffd6a12", "61243f0831ac6f9a2048d5f01a2f0941"},
        Promise{"thesis_4_1", "000094bce98416a285745577ef054c53", "cbfc347c64d03776c6c3511a7ec47cd2"},
        Promise{"thesis_4_1_initial_noise", "4cd3a01c544a6f71fd5f75ce700c8bb7", "84a0e0bcda39660ba5540e56b870d9ce"},
        Promise{"thesis_4_1_minimum_noise", "b019e42c0352bcf71a84c08985839a42", "dd5f38ba25603e0c0a492642c495c10d"},
        Promise{"thesis_4_1_reuse", "95af65d3919621e8e34cc340883338b8", "5c156446a8dc34e393319a06be4f757f"},
        Promise{"thesis_4_2", "5f021b3a18dae9d6e20d5843ff9e20ea", "a2f88e8ebc29935bc6fd3f48688c544f"},
        Promise{"thesis_4_2_initial_noise", "1a5110dffa0ee6ea9e75579b943dfc75", "b8c85919fde4417dec8fced639e11166"},
        Promise{"thesis_4_2_minimum_noise", "0c28fbe3a16076669a4bdad58596ef6f", "1071acdeacdbf94e9def465aa958a26b"},
        Promise{"thesis_4_3", "f7fd6fb9210ad36fefafe2d5c1cf92d8", "75422cbb2de0cb34ef009d3d4a81d803", true},
        Promise{"thesis_frames", "e6656beb762f489fae57223d786e3db3", "f3859a58649dde4c864f17fa16c1fce2"},
        Promise{"track", "3d87223ce9e87c02fb71ccf9c58c00f7", "ceda84b7581be9c432e94449016f7b63"},
        Promise{"trajectory_untuned", "1b7f8a3e67970ca3e3ee3372396a1c56", "06cdc6b3ad2d01fc26035219b9426ee0"},
        Promise{"thesis_window", "cb7f7cf34273b2ba9f18ed71d0411f59", "eebed56592c4b9bd87bf74fbf2a1912e"}  // clang-format on
        ),
    [](const auto& info) { return info.param.study; });

}  // namespace
}  // namespace treeroll
