#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tests/end_to_end/network.h"
#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {

/// Tests of the daemons on a network of their own; skipped, with the reason, where there can be
/// none.
class NetworkTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const auto reason = Network::refusal()) GTEST_SKIP() << *reason;
  }

  std::unique_ptr<Daemon> worker(const Network& network, int host, int processes) const;
  /// A learner of a study file, with its state in the folder `name`.
  std::unique_ptr<Daemon> learner(const Network& network, int host,
                                  const std::filesystem::path& study, const std::string& name,
                                  const std::vector<std::string>& more = {}) const;
  /// A learner that goes on in the folder `name`.
  std::unique_ptr<Daemon> resumed(const Network& network, int host, const std::string& name) const;

  std::filesystem::path state(const std::string& name) const { return service_.directory() / name; }

  /// What one process learns from the study, without network and workers.
  /// @param overrides  what makes it faster and changes no reward
  struct Files {
    std::string rollouts_csv;
    std::string runs_csv;
  };
  Files learnt_alone(const std::filesystem::path& study,
                     const std::vector<std::string>& overrides = {}) const;
  /// The learner ends well, within the limit, with these files, no roll-out failed.
  Service::Learnt expect_learnt(Daemon& learner, const std::string& name, const Files& files) const;
  /// The journal follows from the study and the rewards in it, as far as it goes.
  void expect_verified(const std::string& name) const;

  Service service_;
};

/// Ends a worker daemon in good order; how many roll-outs it says it has evaluated.
std::int64_t num_evaluated(Daemon& worker);

/// Waits until the learner of this state directory has so many more bytes in its journal.
bool journal_grows(const std::filesystem::path& state, std::uintmax_t num_bytes);

/// Thirty runs, one roll-out of each in flight, of the swing-up in ODE.
std::string swing_up_study(int rollouts);
/// Thirty runs, one roll-out of each in flight, of the synthetic task; it burns processor time.
std::string synthetic_study(int rollouts, int duration_us);
/// The same, but it sleeps, and is taken for blocked after a second or two.
std::string sleeping_study(int rollouts, int duration_us, int seed = 12);
/// Thirty runs, one roll-out of each in flight, that sleep and have all the time they want.
std::string patient_study(int rollouts, std::int64_t duration_us);
/// An override of these: their roll-outs take no time, and have the same rewards.
inline const std::vector<std::string> kAtOnce{"task.duration_us=0"};

}  // namespace treeroll::end_to_end
