// Hosts that are heard and do not answer, workers that hold roll-outs for ever, learners that die:
// nobody else waits for them, and what is learnt stays the same to the bit.
#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/end_to_end/network_test.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;

constexpr int kRolloutUs = 20'000;

class AnsweringTest : public NetworkTest {
 protected:
  struct Taken {
    double seconds = 0;
    std::string log;
  };
  /// Learns the study on host 0 to its end, with the files of one process alone.
  Taken learn(const Network& network, const fs::path& study, const std::string& name) {
    if (files_.rollouts_csv.empty()) files_ = learnt_alone(study, kAtOnce);
    const auto start = Clock::now();
    const auto near = learner(network, 0, study, name);
    Taken taken{.log = expect_learnt(*near, name, files_).log};
    taken.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    return taken;
  }

  /// Prints what the trouble costs. Machines are noisy, so what is held to is coarse: without the
  /// cure such a study takes ten times as long or does not end.
  static void expect_little_more(const char* trouble, const Taken& healthy, const Taken& taken) {
    const double ratio = taken.seconds / healthy.seconds;
    std::printf("  %s: %.2f s, healthy workers alone %.2f s, %.2f times as long\n", trouble,
                taken.seconds, healthy.seconds, ratio);
    EXPECT_LE(ratio, 2) << taken.log;
  }

  Files files_;
};

TEST_F(AnsweringTest, AHostThatIsHeardAndDeafHoldsNothingUp) {
  const fs::path study = service_.study(patient_study(20, kRolloutUs));
  Network network(3);
  const auto sound = worker(network, 1, 2);
  const Taken healthy = learn(network, study, "healthy");
  network.deafen(2);
  const auto deaf = worker(network, 2, 2);
  const Taken taken = learn(network, study, "deaf");
  expect_little_more("one host deaf", healthy, taken);
  const std::string words = "is heard but does not answer: does what we send reach it?";
  EXPECT_EQ(count_of(taken.log, words), 1) << "once a spell\n" << taken.log;
  EXPECT_EQ(num_evaluated(*deaf), 0);
}

TEST_F(AnsweringTest, AHostThatBecomesDeafInTheMidstHoldsNothingUp) {
  const fs::path study = service_.study(patient_study(20, kRolloutUs));
  Network network(3);
  const auto sound = worker(network, 1, 2);
  const Taken healthy = learn(network, study, "healthy");
  const auto start = Clock::now();
  const auto deaf = worker(network, 2, 2);
  const auto near = learner(network, 0, study, "state");
  ASSERT_TRUE(journal_grows(state("state"), 5'000));
  network.deafen(2);
  Taken taken{.log = expect_learnt(*near, "state", files_).log};
  taken.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  expect_little_more("one host becomes deaf", healthy, taken);
  EXPECT_GT(num_evaluated(*deaf), 0) << "it was deaf from the start";
}

TEST_F(AnsweringTest, AWorkerThatHoldsRolloutsForEverHoldsNothingUp) {
  const fs::path study = service_.study(patient_study(20, kRolloutUs));
  Network network(3);
  const auto sound = worker(network, 1, 2);
  const Taken healthy = learn(network, study, "healthy");
  const auto stuck = worker(network, 2, 2);
  ASSERT_TRUE(eventually(seconds(20), [&] { return stuck->children().size() == 2; }));
  const auto start = Clock::now();
  const auto near = learner(network, 0, study, "state");
  ASSERT_TRUE(journal_grows(state("state"), 5'000));
  for (const pid_t evaluator : stuck->children()) ::kill(evaluator, SIGSTOP);
  Taken taken{.log = expect_learnt(*near, "state", files_).log};
  taken.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  expect_little_more("one worker stuck", healthy, taken);
  for (const pid_t evaluator : stuck->children()) ::kill(evaluator, SIGCONT);
}

TEST_F(AnsweringTest, AWorkerWhoseLearnerDiedServesTheNextOne) {
  const fs::path endless = service_.study(patient_study(20, 3'000'000'000));
  Network network(3);
  const auto left_alone = worker(network, 1, 2);
  const auto doomed = learner(network, 0, endless, "doomed");
  ASSERT_TRUE(eventually(seconds(20), [&] { return left_alone->children().size() == 2; }));
  ASSERT_TRUE(eventually(seconds(20), [&] {
    return left_alone->standard_error().find("serves learner") != std::string::npos;
  }));
  std::this_thread::sleep_for(seconds(1));  // for the leases behind the greeting
  const std::vector<pid_t> evaluators = left_alone->children();
  doomed->kill(SIGKILL);
  ASSERT_EQ(doomed->wait(seconds(10)), 128 + SIGKILL);

  const fs::path study = service_.study(patient_study(20, kRolloutUs));
  const Taken taken = learn(network, study, "next");
  EXPECT_THAT(left_alone->standard_error(), HasSubstr("has been silent for 12 s: gives its"));
  for (const pid_t evaluator : evaluators) {
    EXPECT_NE(::kill(evaluator, 0), 0) << "an evaluator works on for a learner that is gone";
  }

  const Taken healthy = learn(network, study, "healthy");
  const auto doomed_too = learner(network, 0, endless, "doomed_too");
  const auto num_served = [&] { return count_of(left_alone->standard_error(), "serves learner"); };
  ASSERT_TRUE(eventually(seconds(20), [&] { return num_served() >= 4; }));
  std::this_thread::sleep_for(seconds(1));
  doomed_too->kill(SIGKILL);
  const auto sound = worker(network, 2, 2);
  expect_little_more("a worker's learner died", healthy, learn(network, study, "beside"));
}

}  // namespace
}  // namespace treeroll::end_to_end
