#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/program/command_line.h"

namespace treeroll::benchmarks {

/// What is measured of a peer: the options all of them share.
struct PeerOptions {
  std::filesystem::path study;
  std::vector<std::string> overrides;
  int workers = 2;
  int batch = 16;        ///< roll-outs a message
  int outstanding = 2;   ///< messages a worker has at a time
  int warm_up_ms = 300;  ///< not counted
  int measured_ms = 2000;
};

void describe(CommandLine& line, PeerOptions& options);

}  // namespace treeroll::benchmarks
