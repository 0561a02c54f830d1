#include "tests/benchmarks/peer_options.h"

#include "tests/benchmarks/peer_rollouts.h"

namespace treeroll::benchmarks {

void describe(CommandLine& line, PeerOptions& options) {
  line.add("STUDY", options.study, "Whose first condition is executed").required();
  line.add("--set", options.overrides, "KEY=VALUE of the study").one_value_each_time();
  line.add("--workers", options.workers, "Processes that execute").between(1, 1024).shows_default();
  line.add("--batch", options.batch, "Roll-outs a message")
      .between(1, kPeerBatchMax)
      .shows_default();
  line.add("--outstanding", options.outstanding, "Messages a worker has at a time")
      .between(1, 64)
      .shows_default();
  line.add("--warm-up-ms", options.warm_up_ms, "Not counted").between(0, 60'000).shows_default();
  line.add("--measured-ms", options.measured_ms, "Counted").between(1, 600'000).shows_default();
}

}  // namespace treeroll::benchmarks
