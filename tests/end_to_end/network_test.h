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

  Service service_;
};

/// Ends a worker daemon in good order; how many roll-outs it says it has evaluated.
std::int64_t num_evaluated(Daemon& worker);

/// Roll-outs in the journal of a state directory, which may be written meanwhile; 0 while there is
/// none.
std::int64_t num_journalled(const std::filesystem::path& state);

/// Thirty runs, one roll-out of each in flight, of the swing-up in ODE.
std::string swing_up_study(int rollouts);
/// Thirty runs, one roll-out of each in flight, that burn some microseconds of processor time.
std::string synthetic_study(int rollouts, int duration_us);

}  // namespace treeroll::end_to_end
