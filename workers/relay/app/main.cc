#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>

#include "common/base/config_error.h"
#include "common/program/host_name.h"
#include "common/program/process_start.h"
#include "common/program/program.h"
#include "common/program/random_id.h"
#include "common/protocol/limits.h"
#include "workers/relay/app/relay_daemon.h"

namespace treeroll::relay {
namespace {

struct Options {
  std::string above;
  std::string below;
  std::string numeric_class;
};

void describe_relay(CommandLine& line, Options& options) {
  line.add("--above", options.above,
           "LCM URL of the learners [LCM_DEFAULT_URL, else udpm://239.255.76.67:7667?ttl=0]");
  line.add("--below", options.below, "LCM URL of the workers: another group, port or server")
      .required();
  line.add("--numeric-class", options.numeric_class,
           "Serve workers of this class alone; default: that of the first one heard. A relay mixes "
           "no classes");
  line.end_help_with(
      "To the learners it is one worker with as many evaluators as all workers below have.\n"
      "Exit status: 0 drained; 2 bad input; 1 anything else, also a second SIGTERM, SIGINT or "
      "SIGHUP.");
}

int serve(const Options& options) {
  end_when_stopped(kExitDone, "asked to end while it was starting\n");
  if (options.numeric_class.size() > protocol::kNumericClassBytesMax ||
      !std::all_of(options.numeric_class.begin(), options.numeric_class.end(),
                   [](char c) { return c >= ' ' && c <= '~'; })) {
    throw ConfigError("--numeric-class", readable(options.numeric_class),
                      "must be at most " + std::to_string(protocol::kNumericClassBytesMax) +
                          " visible ASCII characters");
  }
  RelaySettings settings;
  settings.relay_id = random_id();
  settings.host = host_name();
  settings.pid = getpid();
  settings.version = program_version();
  settings.numeric_class = options.numeric_class;
  const std::string above = transport::resolve_url(options.above);
  auto daemon = RelayDaemon::open(above, options.below, settings);
  if (!daemon) {
    spdlog::error("{}", daemon.error().message);
    return kExitBadInput;
  }
  spdlog::info("relay {} between the learners on {} and the workers on {}", settings.relay_id,
               above, options.below);
  const int status = (*daemon)->run();
  spdlog::info("ends with status {}", status);
  return status;
}

}  // namespace
}  // namespace treeroll::relay

int main(int argc, char** argv) {
  treeroll::relay::Options options;
  return treeroll::run_main(
      argc, argv,
      {.name = "treeroll-relay",
       .purpose =
           "Passes roll-outs of the learners on one LCM network on to the workers of another.",
       .log_name = "relay",
       .examples = {{"treeroll-relay --below 'udpm://239.255.76.68:7667?ttl=1'",
                     "the workers of that group are one worker to the learners of this one"}},
       .options = [&](treeroll::CommandLine& line) { describe_relay(line, options); },
       .work = [&] { return serve(options); }});
}
