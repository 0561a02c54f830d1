// Many workers: what their heartbeats come to, and that nothing else changes. With relays as many
// as TREEROLL_SIMULATION_WORKERS says.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "common/protocol/timings.h"
#include "tests/simulation/simulation.h"

namespace treeroll::simulation {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// Each worker has an evaluator, and two roll-outs of a second or two at a time.
Scenario crowd(int num_workers, int num_relays, Duration joining) {
  Scenario scenario = calm_scenario(4);  // in sequence, four in flight, batches of a frame
  Study& study = scenario.studies[0];
  study.conditions.resize(1);
  study.in_sequence = true;
  study.conditions[0].exploration.in_flight = 4;
  study.conditions[0].exploration.num_rollouts = 16;
  study.repetitions = std::max(1, num_workers / 2);
  scenario.batch_bytes_max = protocol::kBatchBytesRemoteMax;
  scenario.task.duration_min = seconds(1);
  scenario.task.duration_max = seconds(2);
  scenario.task.time_limit = seconds(10);
  scenario.num_relays = num_relays;
  scenario.workers.clear();
  for (int i = 0; i < num_workers; ++i) {
    scenario.workers.push_back({.joins = TimePoint(joining * i / num_workers),
                                .num_evaluators = 1,
                                .relay = num_relays > 0 ? i % num_relays : -1});
  }
  return scenario;
}

struct Seen {
  double heartbeats_per_s = 0;
  double messages_per_s = 0;  ///< to the learner, heartbeats among them
};

Seen learn_in_crowd(const Scenario& scenario, const char* what) {
  Simulation simulation(scenario);
  simulation.run();
  const Observer& seen = simulation.observer();
  EXPECT_FALSE(seen.broken()) << seen.violation();
  // Idle evaluators are given what others are late with.
  EXPECT_LE(static_cast<double>(seen.num_simulations),
            1.1 * (num_rollouts(scenario) + 2 * num_runs(scenario)));
  const double length_s = to_seconds(simulation.end() - TimePoint{});
  const Seen rates{static_cast<double>(seen.num_heartbeats) / length_s,
                   static_cast<double>(seen.num_messages_heard) / length_s};
  std::printf(
      "  %5zu workers %-16s %4.0f roll-outs/s, to the learner %4.0f heartbeats/s of %5.0f "
      "messages/s\n",
      scenario.workers.size(), what, num_rollouts(scenario) / length_s, rates.heartbeats_per_s,
      rates.messages_per_s);
  return rates;
}

TEST(CrowdTest, HundredsOfWorkersBeatNoMoreThanHundredsOfTimesASecond) {
  const Seen seen = learn_in_crowd(crowd(250, 0, milliseconds(500)), "at one learner");
  // A greeting each, and what is sent before they are told; usual heartbeats would be 2500 a
  // second.
  EXPECT_LE(seen.heartbeats_per_s, 1.5 * protocol::kHeartbeatsPerSecondMax);
}

TEST(CrowdTest, BehindRelaysThousandsAreAFewToTheLearner) {
  int num_workers = 300;
  if (const char* told = std::getenv("TREEROLL_SIMULATION_WORKERS")) num_workers = std::stoi(told);
  const int num_relays = num_workers / 100;
  const Seen seen =
      learn_in_crowd(crowd(num_workers, num_relays, milliseconds(500)), "behind relays");
  EXPECT_LE(seen.heartbeats_per_s, 25 * num_relays);
}

}  // namespace
}  // namespace treeroll::simulation
