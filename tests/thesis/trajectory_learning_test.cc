#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <string>

#include "tests/thesis/run_study.h"
#include "tests/thesis/studies.h"

/// Sections 4-1-2, 4-2-2 and A-4-3: learning trajectories. The figures are means over 30
/// repetitions of the rewards near roll-outs 50, 100, 200 and 400, found independently with other
/// random numbers.
namespace treeroll {
namespace {

constexpr double kFigureTolerance = .12;
constexpr int kPlaces[] = {50, 100, 200, 400};

const std::vector<RunRecord>& experiment(const std::string& file) {
  static std::map<std::string, std::vector<RunRecord>> experiments;
  auto found = experiments.find(file);
  if (found == experiments.end()) {
    found = experiments.emplace(file, run_study(kStudies / file, {"study.seed=3"})).first;
  }
  return found->second;
}

double near(const std::string& file, const std::string& condition, int n) {
  return mean_near(of_condition(experiment(file), condition), n);
}

struct Row {
  const char* file;
  const char* goal;
  double layer_1[4];
  double flat[4];
  double tree[4];
};

const Row kRows[] = {
    {"thesis_4_1.toml", "single", {.20, .22, .25, .33}, {.59, .76, .84, .84}, {.31, .62, .81, .86}},
    {"thesis_4_1.toml",
     "single_offset",
     {.18, .22, .25, .31},
     {.12, .55, .77, .82},
     {.21, .44, .73, .84}},
    {"thesis_4_1.toml", "multi", {.37, .60, .74, .79}, {.18, .63, .83, .85}, {.37, .67, .83, .82}},
    {"thesis_4_1.toml",
     "multi_offset",
     {.23, .59, .74, .78},
     {.04, .44, .80, .84},
     {.23, .64, .82, .82}},
    {"thesis_4_2.toml", "single", {.18, .27, .43, .57}, {.42, .61, .77, .83}, {.21, .44, .71, .82}},
    {"thesis_4_2.toml", "multi", {.30, .58, .76, .78}, {.12, .56, .75, .81}, {.30, .62, .81, .83}},
};

TEST(TrajectoryLearningTest, Sections412And422TheLearningCurvesComeOut) {
  for (const Row& row : kRows) {
    const std::string goal = row.goal;
    for (int i = 0; i < 4; ++i) {
      const auto expect = [&](const std::string& model, double figure) {
        const double measured = near(row.file, goal + "." + model, kPlaces[i]);
        EXPECT_NEAR(measured, figure, kFigureTolerance)
            << row.file << " " << goal << "." << model << " near roll-out " << kPlaces[i];
      };
      expect("layer_1", row.layer_1[i]);
      expect("flat", row.flat[i]);
      expect("tree", row.tree[i]);
    }
  }
}

TEST(TrajectoryLearningTest, SectionA43TheLearningCurvesOfTheSpiralComeOut) {
  const int places[] = {200, 400, 1000};
  const double cholesky[] = {.053, .129, .535};
  const double pourahmadi[] = {.049, .106, .393};
  for (int i = 0; i < 3; ++i) {
    const double of_cholesky = near("spiral.toml", "cholesky", places[i]);
    const double of_pourahmadi = near("spiral.toml", "pourahmadi", places[i]);
    std::printf("  near roll-out %d: Cholesky %.3f, Pourahmadi %.3f\n", places[i], of_cholesky,
                of_pourahmadi);
    EXPECT_NEAR(of_cholesky, cholesky[i], kFigureTolerance) << places[i];
    EXPECT_NEAR(of_pourahmadi, pourahmadi[i], kFigureTolerance) << places[i];
  }
}

TEST(TrajectoryLearningTest, Sections412And422TheTreeIsAheadAt50WhereThereAreSeveralResolutions) {
  EXPECT_GT(near("thesis_4_1.toml", "multi.tree", 50), near("thesis_4_1.toml", "multi.flat", 50));
  EXPECT_GT(near("thesis_4_1.toml", "multi_offset.tree", 50),
            near("thesis_4_1.toml", "multi_offset.flat", 50));
  EXPECT_GT(near("thesis_4_2.toml", "multi.tree", 50), near("thesis_4_2.toml", "multi.flat", 50));
}

TEST(TrajectoryLearningTest, Sections412And422TheFlatModelIsAheadAt50WhereThereIsOneResolution) {
  for (const char* file : {"thesis_4_1.toml", "thesis_4_2.toml"}) {
    EXPECT_GT(near(file, "single.flat", 50), near(file, "single.tree", 50)) << file;
  }
}

TEST(TrajectoryLearningTest, Sections412And422TheSecondLayerIsNeededInTheEnd) {
  for (const Row& row : kRows) {
    const std::string goal = row.goal;
    const double layer_1 = near(row.file, goal + ".layer_1", 400);
    EXPECT_LT(layer_1, near(row.file, goal + ".flat", 400)) << row.file << " " << goal;
    EXPECT_LT(layer_1, near(row.file, goal + ".tree", 400)) << row.file << " " << goal;
  }
}

}  // namespace
}  // namespace treeroll
