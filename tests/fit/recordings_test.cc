#include "learner/fit/recordings.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/numbers/random_stream.h"
#include "learner/fit/relative_error.h"
#include "learner/fit/sufficient.h"
#include "tests/fit/read_start.h"

namespace treeroll {
namespace {

using ::testing::HasSubstr;

/// size x sin(3 t + phase) + offset over [0, 2].
Eigen::MatrixXd sine(int num_samples, double size, double offset = 0, double phase = 0) {
  Eigen::MatrixXd one(2, num_samples);
  for (int n = 0; n < num_samples; ++n) {
    const double t = 2. * n / (num_samples - 1);
    one.col(n) << t, offset + size * std::sin(3 * t + phase);
  }
  return one;
}

Eigen::MatrixXd beside(const std::vector<Eigen::MatrixXd>& recordings) {
  Eigen::MatrixXd all = recordings[0];
  for (std::size_t k = 1; k < recordings.size(); ++k) {
    const Eigen::Index before = all.cols();
    all.conservativeResize(Eigen::NoChange, before + recordings[k].cols());
    all.rightCols(recordings[k].cols()) = recordings[k];
  }
  return all;
}

double rms(const Eigen::MatrixXd& data) {
  return std::sqrt(data.row(1).squaredNorm() / static_cast<double>(data.cols()));
}

TEST(SpreadOfRecordingsTest, IsTheErrorOfTheirMean) {
  const Eigen::MatrixXd apart = beside({sine(101, 1, .3), sine(101, 1), sine(101, 1, -.3)});
  const Eigen::MatrixXd mean = beside({sine(101, 1), sine(101, 1), sine(101, 1)});
  EXPECT_NEAR(spread_of_recordings(apart, 1), relative_rms(mean.row(1), apart.row(1)), 1e-12);
  // At other times, as many or fewer of them, it is the same to what straight lines leave.
  const Eigen::MatrixXd shifted = beside({sine(101, 1, .3), sine(87, 1), sine(113, 1, -.3)});
  const double mean_offset = .3 * (101 - 113) / 301;
  const double variance = .09 * (101 + 113) / 301 - mean_offset * mean_offset;
  EXPECT_NEAR(spread_of_recordings(shifted, 1), std::sqrt(variance) / rms(shifted), .001);
}

/// A hundred samples a second count ten times as much as ten: so they do in a fit.
TEST(SpreadOfRecordingsTest, CountsEachRecordingByItsSamples) {
  const Eigen::MatrixXd apart = beside({sine(2001, 1, .3), sine(201, 1, -.3)});
  EXPECT_NEAR(spread_of_recordings(apart, 1), std::sqrt(.36 * 10 / 121) / rms(apart), .002);
}

TEST(SpreadOfRecordingsTest, IsNothingOfOneRecordingHoweverItIsWritten) {
  EXPECT_EQ(spread_of_recordings(sine(101, 1), 1), 0);
  EXPECT_EQ(spread_of_recordings(sine(101, 1).rowwise().reverse(), 1), 0);
  Eigen::MatrixXd stands_still = sine(101, 1);
  stands_still(0, 50) = stands_still(0, 49);
  EXPECT_EQ(spread_of_recordings(stands_still, 1), 0);
  Eigen::MatrixXd in_no_order = sine(101, 1);
  for (Eigen::Index n = 0; n < 101; ++n) in_no_order.col(n) = sine(101, 1).col(n * 37 % 101);
  EXPECT_EQ(spread_of_recordings(in_no_order, 1), 0);
  EXPECT_EQ(sufficient_error(sine(101, 1), 1), kSufficientError);
}

TEST(SpreadOfRecordingsTest, IsNothingWhereRecordingsAreAlikeOrHaveNoTimeInCommon) {
  EXPECT_EQ(spread_of_recordings(beside({sine(101, 1), sine(101, 1)}), 1), 0);
  Eigen::MatrixXd later = sine(101, 1, 5);
  later.row(0).array() += 2.5;
  EXPECT_EQ(spread_of_recordings(beside({later, sine(101, 1)}), 1), 0);
  // Over a gap nothing is known of a recording.
  Eigen::MatrixXd gap(2, 40);
  gap << sine(101, 1).leftCols(20), sine(101, 1).rightCols(20);
  EXPECT_EQ(spread_of_recordings(beside({gap, sine(101, 1)}), 1), 0);
  const Eigen::MatrixXd apart = beside({sine(101, 1), sine(101, 2)});
  EXPECT_GT(spread_of_recordings(apart, 1), .2);
  Eigen::MatrixXd of_states(3, apart.cols());
  of_states << apart.row(0), apart;
  EXPECT_EQ(spread_of_recordings(of_states, 2), 0);
}

TEST(SpreadOfRecordingsTest, CountsEachOutputInItsUnitAndWhatIsThere) {
  const Eigen::MatrixXd x = beside({sine(101, 1, .3), sine(101, 1, -.3)});
  Eigen::MatrixXd both(3, x.cols());
  both << x, 1000 * x.row(1);
  EXPECT_NEAR(spread_of_recordings(both, 1), spread_of_recordings(x, 1), 1e-12);
  for (Eigen::Index n = 0; n < both.cols(); ++n) {
    both(1 + n % 2, n) = std::numeric_limits<double>::quiet_NaN();
  }
  EXPECT_NEAR(spread_of_recordings(both, 1), spread_of_recordings(x, 1), .01);
}

/// What people do, who are never equally strong nor equally fast; sensors are noisy too.
std::string reach(int number) {
  RandomStream noise(7, 0, static_cast<std::uint64_t>(number), RandomPurpose::kFit);
  const Eigen::MatrixXd one = sine(101, .8 + .2 * number, 0, .1 * (number - 1));
  std::string text = "t,x\n";
  for (Eigen::Index n = 0; n < one.cols(); ++n) {
    text += fmt::format("{},{}\n", one(0, n), one(1, n) + .05 * noise.next_normal());
  }
  return text;
}

TEST(SufficientErrorTest, RecordingsThatDifferHaveAStartOfEveryKind) {
  const auto read = [](const std::string& name) { return reach(name[0] - '0'); };
  const Eigen::MatrixXd mean = sine(101, 1);
  for (const char* kind : {"auto", "spline", "rbf", "dmp", "tree"}) {
    for (const char* align : {"none", "duration"}) {
      const StartPolicy start = read_start(
          fmt::format(R"({{"kind": "{}", {} "demonstration": {{"kind": "csv", "files": ["0", "1",
                         "2"], "align": "{}", "inputs": ["t"], "outputs": ["x"]}}}})",
                      kind, std::string(kind) == "tree" ? R"("components": "auto",)" : "", align),
          {.read_file = read});
      EXPECT_LT(rms_error(*start.policy, mean), .15 * rms(mean)) << kind;
    }
  }
}

TEST(SufficientErrorTest, SaysThatItIsTheMeanThatIsNotMet) {
  const auto read = [](const std::string& name) {
    std::string text = "t,x\n";
    for (int n = 0; n < 300; ++n) {
      text += fmt::format("{},{}\n", n, (n % 2 == 0 ? 1 : -1) + (name == "a" ? .2 : -.2));
    }
    return text;
  };
  EXPECT_THAT(refusal_of(R"({"kind": "spline", "demonstration": {"kind": "csv", "files": ["a", "b"],
                             "inputs": ["t"], "outputs": ["x"]}})",
                         {.read_file = read}),
              HasSubstr("none come within 0.22 of the outputs' rms, and so of the recordings' mean "
                        "within a tenth, the best within"));
}

}  // namespace
}  // namespace treeroll
