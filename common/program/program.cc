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
  command_line.add_examples(program.examples);
  program.options(command_line);
  std::string log_form = "text";
  command_line.add("--log", log_form, "Lines on standard error: text, or json, one object a line")
      .one_of({"text", "json"})
      .shows_default();
  switch (command_line.read(argc, argv)) {
    case CommandLine::Reading::kComplete:
      break;
    case CommandLine::Reading::kAnswered:
      return kExitDone;
    case CommandLine::Reading::kWrong:
      return kExitBadInput;
  }
  if (log_form == "json") log_as_json(program.name);
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
