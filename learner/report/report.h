#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "learner/worker_program/worker_program.h"

namespace treeroll::report {

/// The command line of treeroll-report.
struct ReportOptions {
  std::vector<std::filesystem::path> directories;  ///< state directories of studies
  std::filesystem::path claims_file = {};          ///< empty: no table of claims
  std::filesystem::path output = "report";         ///< folder, made if need be
  std::vector<std::string> compare = {};           ///< two conditions, or none
  WorkerProgram worker_program = {};               ///< makes the roll-outs that are shown
  bool needs_worker_program = false;               ///< else, if it is not there, none are shown
};

/// Writes report.html, report.md and report.json, each whole or not at all, and prints what they
/// came to. The same results give the same bytes: neither dates nor paths are in them. Throws
/// StudyError or ConfigError for bad input and std::runtime_error for what cannot be read or
/// written.
void write_report(const ReportOptions& options);

}  // namespace treeroll::report
