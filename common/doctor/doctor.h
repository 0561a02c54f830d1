#pragma once

#include <filesystem>
#include <string>

namespace treeroll::doctor {

/// The command line of treeroll-doctor.
struct DoctorOptions {
  std::string lcm_url;             ///< resolved
  std::filesystem::path key_file;  ///< empty: nothing is signed; a learner's, or a worker's
  std::filesystem::path folder;    ///< where results go: its disk is looked at
  int seconds = 0;                 ///< how long it listens
  bool json = false;
};

/// Looks at this host, its way to the group and who is there, and prints a line for each.
/// @return whether nothing was in trouble
bool examine(const DoctorOptions& options);

}  // namespace treeroll::doctor
