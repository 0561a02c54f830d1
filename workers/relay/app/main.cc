#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <utility>

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
  std::filesystem::path key_file;
  std::filesystem::path key_file_below;
};

void describe_relay(CommandLine& line, Options& options) {
  line.add("--above", options.above,
           "LCM URL of the learners [LCM_DEFAULT_URL, else udpm://239.255.76.67:7667?ttl=0]");
  line.add("--below", options.below, "LCM URL of the workers: another group, port or server")
      .required();
  line.add("--numeric-class", options.numeric_class,
           "Serve workers of this class alone; default: that of the first one heard. A relay mixes "
           "no classes");
  line.add(
      "--key-file", options.key_file,
      "Keys of treeroll-keygen: what is said is signed, what is not signed is refused. Above a "
      "worker's is enough");
  line.add("--key-file-below", options.key_file_below,
           "The same below, where a learner's key is needed; default: that of --key-file");
  line.end_help_with(
      "To the learners it is one worker with as many evaluators as all workers below have.\n"
      "Exit status: 0 drained; 2 bad input; 1 anything else, also a second SIGTERM, SIGINT or "
      "SIGHUP.");
}

RelayKeys keys_of(const Options& options) {
  const bool is_one = options.key_file_below.empty();
  return {transport::key_file_of("--key-file", options.key_file, transport::Voice::kWorker),
          transport::key_file_of(is_one ? "--key-file (--key-file-below)" : "--key-file-below",
                                 is_one ? options.key_file : options.key_file_below,
                                 transport::Voice::kLearner)};
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
  const std::string above = transport::daemon_url("--above", options.above);
  const std::string below = transport::daemon_url("--below", options.below);
  RelayKeys keys = keys_of(options);
  if (keys.above) settings.relay_id = keys.above->keys().worker_id(settings.relay_id);
  const std::string trust =
      fmt::format("above: {}; below: {}", transport::trust_in_words(keys.above),
                  transport::trust_in_words(keys.below));
  auto daemon = RelayDaemon::open(above, below, settings, std::move(keys));
  if (!daemon) {
    spdlog::error("{}", daemon.error().message);
    return kExitOther;
  }
  spdlog::info("relay {} between the learners on {} and the workers on {}", settings.relay_id,
               above, below);
  spdlog::info("{}", trust);
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
