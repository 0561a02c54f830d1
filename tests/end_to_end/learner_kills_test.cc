// The learner is killed a hundred times at random moments; nothing is lost and nothing is learnt
// twice.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <random>

#include "tests/end_to_end/network_test.h"

namespace treeroll::end_to_end {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::seconds;

class LearnerKillsTest : public NetworkTest {};

TEST_F(LearnerKillsTest, AfterAHundredKillsTheFilesAreThoseOfAnUndisturbedRun) {
  const char* given = std::getenv("TREEROLL_KILL_SEED");
  const unsigned seed = given == nullptr ? std::random_device{}()
                                         : static_cast<unsigned>(std::strtoul(given, nullptr, 10));
  std::cout << "repeat the moments with TREEROLL_KILL_SEED=" << seed << "\n";
  std::mt19937 dice(seed);
  const auto study = service_.study(sleeping_study(1000, 200));
  Network network(2);
  network.lose(10);
  const auto far = worker(network, 1, 2);
  auto near = learner(network, 0, study, "state");
  // 30 000 results of about 94 bytes: the last kill comes before the end, many come within a write.
  std::uniform_int_distribution<int> num_bytes(1, 30'000);
  std::uniform_int_distribution<int> delay_us(0, 3'000);
  for (int kill = 0; kill < 100; ++kill) {
    ASSERT_TRUE(journal_grows(state("state"), static_cast<std::uintmax_t>(num_bytes(dice))))
        << near->standard_error();
    const auto moment = Clock::now() + std::chrono::microseconds(delay_us(dice));
    while (Clock::now() < moment) {
    }
    near->kill(SIGKILL);
    ASSERT_EQ(near->wait(seconds(10)), 128 + SIGKILL)
        << "it ended before it was killed, kill " << kill;
    expect_verified("state");
    if (HasFailure()) FAIL() << "kill " << kill << ", seed " << seed;
    near = resumed(network, 0, "state");
  }
  expect_learnt(*near, "state", learnt_alone(study, kAtOnce));
  expect_verified("state");
}

}  // namespace
}  // namespace treeroll::end_to_end
