#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {

/// Two conditions, two repetitions each, in one order or the other.
inline std::string study_text(const std::string& order) {
  return text_of(SyntheticStudy{
      "name = \"small\"\nseed = 5\nrepetitions = 2\nrollouts = 60\nin_flight = 2\norder = \"" +
          order + "\"",
      "mode = \"sleep\"\nduration_us = 500"});
}

class ReplayTest : public ::testing::Test {
 protected:
  /// Learns the study into the directory of that name.
  std::filesystem::path learn(const std::string& name, const std::string& order = "sequence",
                              int rollouts = 60) {
    const std::filesystem::path directory = service_.directory() / name;
    Daemon learner("treeroll-learner",
                   {service_.study(study_text(order)).string(), "--lcm-url", service_.url(),
                    "--local-workers", "2", "--state-dir", directory.string(), "--set",
                    "study.rollouts=" + std::to_string(rollouts)},
                   service_.directory());
    EXPECT_EQ(learner.wait(std::chrono::seconds(60)), 0) << learner.standard_error();
    return directory;
  }
  Said run(const std::string& program, const std::vector<std::string>& arguments) const {
    return service_.run(program, arguments);
  }
  Said verify(const std::filesystem::path& directory) const {
    return run("treeroll-replay", {directory.string(), "--verify"});
  }

  Service service_;
};

}  // namespace treeroll::end_to_end
