// Policies of many frames: what they cost until the first reward, in time and bytes.
#include <gtest/gtest.h>

#include <cstdio>

#include "common/protocol/pieces.h"
#include "tests/simulation/simulation.h"

namespace treeroll::simulation {
namespace {

using std::chrono::hours;
using std::chrono::microseconds;
using std::chrono::milliseconds;

/// One run of one roll-out (and its evaluation) on one worker across a network of frames: it joins
/// once the policy has been published, so it gets what it asks for.
Scenario one_rollout(std::uint64_t seed, const PolicyPtr& start, double loss) {
  Scenario scenario = calm_scenario(seed);
  Study& study = scenario.studies[0];
  study.repetitions = 1;
  study.conditions.resize(1);
  explore::ExplorationSettings& exploration = study.conditions[0].exploration;
  study.conditions[0].start = start;
  exploration.num_rollouts = 1;
  exploration.in_flight = 1;
  exploration.last_layer = start->layer();
  scenario.knows_task = true;
  scenario.batch_bytes_max = protocol::kBatchBytesRemoteMax;
  scenario.task = {.duration_min = milliseconds(1), .duration_max = milliseconds(1)};
  scenario.network = {.loss = loss, .delay_min = microseconds(50), .delay_max = microseconds(150)};
  scenario.workers.assign(1, {TimePoint(milliseconds(500)), 1});
  scenario.load_time = microseconds(200);
  scenario.faults_end = TimePoint(hours(1));
  return scenario;
}

struct Arrival {
  double time_s = 0;  ///< from the worker's start to the end
  double bytes = 0;   ///< of all messages
};

Arrival mean_arrival(const PolicyPtr& start, double loss) {
  constexpr int kNumSeeds = 15;
  Arrival mean;
  Arrival worst;
  for (std::uint64_t seed = 1; seed <= kNumSeeds; ++seed) {
    const Scenario scenario = one_rollout(seed, start, loss);
    Simulation simulation(scenario);
    simulation.run();
    EXPECT_FALSE(simulation.observer().broken()) << simulation.observer().violation();
    const double time_s = to_seconds(simulation.end() - scenario.workers[0].joins);
    worst.time_s = std::max(worst.time_s, time_s);
    mean.time_s += time_s / kNumSeeds;
    mean.bytes += static_cast<double>(simulation.network().num_bytes()) / kNumSeeds;
  }
  std::printf("  %4d pieces, %2.0f %% lost: done in %5.0f ms, at most %5.0f ms; %7.0f kB sent\n",
              protocol::num_pieces(to_json(*start).size()), 100 * loss, 1e3 * mean.time_s,
              1e3 * worst.time_s, mean.bytes / 1e3);
  return mean;
}

TEST(PiecesTest, APolicyOfHundredsOfFramesArrivesInRoundsWhereAThirdIsLost) {
  for (const int num_last : {84, 840, 4096}) {
    const PolicyPtr start = wide_policy(2, num_last);
    const Arrival whole = mean_arrival(start, 0);
    const Arrival third = mean_arrival(start, .3);
    // Each round leaves a third of the pieces, and a round is at most an ask_interval_max; a whole
    // that is sent again would not arrive once in 10^30 times.
    EXPECT_LE(third.time_s, whole.time_s + 2);
    EXPECT_LE(third.bytes, 2.5 * whole.bytes);
  }
}

/// Both of its layers' thetas are past a frame.
TEST(PiecesTest, ThetasOfManyFramesArriveWhereAThirdIsLost) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    Scenario scenario = one_rollout(seed, wide_policy(100, 200), .3);
    explore::ExplorationSettings& exploration = scenario.studies[0].conditions[0].exploration;
    exploration.last_layer = 2;
    exploration.num_rollouts = 12;
    exploration.convergence_slope = kAnySlope;
    exploration.convergence_window = 3;
    Simulation simulation(scenario);
    simulation.run();
    EXPECT_FALSE(simulation.observer().broken()) << simulation.observer().violation();
  }
}

}  // namespace
}  // namespace treeroll::simulation
