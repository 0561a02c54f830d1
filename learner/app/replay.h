#pragma once

#include <filesystem>
#include <string>

namespace treeroll {

/// The command line of treeroll-replay.
struct ReplayOptions {
  std::filesystem::path path;  ///< a state directory, or a journal beside its study.toml
  bool verify = false;
  bool refit = false;                 ///< with verify: fit the start policies again
  std::string export_format;          ///< "csv", "jsonl" or empty
  std::filesystem::path output_file;  ///< of the export; empty: standard output
};

/// Reads a journal, also one that a learner is writing, and changes nothing.
/// Without more: says what is in it and what it has come to. verify: recomputes every perturbation
/// and every update from the study and the rewards, checks each record and their chain, and
/// compares the result files that lie beside it. The start policies are those that the study holds;
/// refit: they are fitted again and compared. export: the results, in the order in which they
/// were accepted.
/// @return  whether all is as it should be; what is not was said on standard error
/// Throws StudyError and ConfigError for bad input, std::runtime_error for what cannot be read or
/// written.
bool replay(const ReplayOptions& options);

}  // namespace treeroll
