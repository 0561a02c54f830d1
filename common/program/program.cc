#include "common/program/program.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <exception>

#include "common/base/bad_input.h"

namespace treeroll {
namespace {

void log_to_standard_error(const Program& program) {
  spdlog::set_default_logger(spdlog::stderr_color_mt(program.name));
  spdlog::set_pattern(program.log_name.empty()
                          ? "%H:%M:%S.%e %^%l%$ %v"
                          : "%Y-%m-%d %H:%M:%S.%e " + program.log_name + "[%P] %^%l%$: %v");
}

}  // namespace

std::string program_version() { return TREEROLL_VERSION; }

int run_main(int argc, char** argv, const Program& program) {
  log_to_standard_error(program);
  CommandLine command_line(program.name, program.purpose, program_version());
  program.options(command_line);
  switch (command_line.read(argc, argv)) {
    case CommandLine::Reading::kComplete:
      break;
    case CommandLine::Reading::kAnswered:
      return kExitDone;
    case CommandLine::Reading::kWrong:
      return kExitBadInput;
  }
  try {
    return program.work();
  } catch (const BadInput& error) {
    spdlog::error("{}", error.what());
    return kExitBadInput;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return kExitOther;
  }
}

}  // namespace treeroll
