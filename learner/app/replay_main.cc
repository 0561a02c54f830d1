#include "common/program/program.h"
#include "learner/app/replay.h"

namespace treeroll {
namespace {

constexpr int kExitDiffers = 1;

void describe(CommandLine& line, ReplayOptions& options) {
  line.add("PATH", options.path, "State directory, or a journal beside its study.toml").required();
  const Option verify =
      line.add("--verify", options.verify,
               "Recompute every perturbation and update, and compare the result files");
  line.add("--refit", options.refit,
           "With --verify: fit the start policies again and compare them with the study's")
      .needs(verify);
  const Option format = line.add("--export", options.export_format,
                                 "Print the results in the order of their acceptance")
                            .one_of({"csv", "jsonl"})
                            .excludes(verify);
  line.add("--output", options.output_file, "File of the export, instead of standard output")
      .needs(format);
}

int replay_main(int argc, char** argv) {
  ReplayOptions options;
  return run_main(
      argc, argv,
      {.name = "treeroll-replay",
       .purpose =
           "Reads a learner's journal: what is in it, and whether every step follows from it.",
       .options = [&](CommandLine& line) { describe(line, options); },
       .work = [&] { return replay(options) ? kExitDone : kExitDiffers; }});
}

}  // namespace
}  // namespace treeroll

int main(int argc, char** argv) { return treeroll::replay_main(argc, argv); }
