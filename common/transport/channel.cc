#include "common/base/check.h"
#include "common/transport/bus.h"

namespace treeroll::transport {

const char* channel_name(Channel channel) {
  switch (channel) {
    case Channel::kRolloutBatch:
      return "TREEROLL_ROLLOUTS";
    case Channel::kRewardBatch:
      return "TREEROLL_REWARDS";
    case Channel::kWorkerStatus:
      return "TREEROLL_WORKERS";
    case Channel::kTaskDefinition:
      return "TREEROLL_TASKS";
    case Channel::kPolicyDefinition:
      return "TREEROLL_POLICIES";
    case Channel::kDefinitionRequest:
      return "TREEROLL_REQUESTS";
    case Channel::kDefinitionReport:
      return "TREEROLL_REPORTS";
    case Channel::kLearnerStatus:
      return "TREEROLL_LEARNER";
    case Channel::kRunStatus:
      return "TREEROLL_RUNS";
    case Channel::kBestPolicy:
      return "TREEROLL_BEST";
  }
  CHECK(false, "a Channel outside its enumeration");
}

}  // namespace treeroll::transport
