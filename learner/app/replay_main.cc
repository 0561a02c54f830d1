#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <exception>

#include "common/base/config_error.h"
#include "learner/app/replay.h"
#include "learner/study/study_error.h"

namespace treeroll {
namespace {

constexpr int kDiffers = 1;  ///< or cannot be read or written
constexpr int kBadInput = 2;

int replay_main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("replay"));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");

  ReplayOptions options;
  CLI::App app{"Reads a learner's journal: what is in it, and whether every step follows from it."};
  app.set_version_flag("--version", TREEROLL_VERSION);
  app.add_option("PATH", options.path, "State directory, or a journal beside its study.toml")
      ->required();
  CLI::Option* verify =
      app.add_flag("--verify", options.verify,
                   "Recompute every perturbation and update, and compare the result files");
  CLI::Option* format = app.add_option("--export", options.export_format,
                                       "Print the results in the order of their acceptance")
                            ->check(CLI::IsMember({"csv", "jsonl"}))
                            ->excludes(verify);
  app.add_option("--output", options.output_file, "File of the export, instead of standard output")
      ->needs(format);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadInput;
  }
  try {
    return replay(options) ? 0 : kDiffers;
  } catch (const ConfigError& error) {
    spdlog::error("{}", error.what());
    return kBadInput;
  } catch (const StudyError& error) {
    spdlog::error("{}", error.what());
    return kBadInput;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return kDiffers;
  }
}

}  // namespace
}  // namespace treeroll

int main(int argc, char** argv) { return treeroll::replay_main(argc, argv); }
