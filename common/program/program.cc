#include "common/program/program.h"

#include <spdlog/spdlog.h>

#include <exception>

#include "common/base/bad_input.h"
#include "common/program/build_id.h"
#include "common/program/log.h"
#include "common/program/process_start.h"

namespace treeroll {

std::string program_version() { return TREEROLL_VERSION; }

int run_main(int argc, char** argv, const Program& program) {
  settle_process();
  log_to_standard_error(program.log_name);
  CommandLine command_line(program.name, program.purpose,
                           program_version() + " (" + build_id() + ")");
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
