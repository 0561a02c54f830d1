#pragma once

#include <algorithm>
#include <string>

#include "tests/learner_core/cluster.h"

/// Studies whose roll-outs are run again on another worker.
namespace treeroll::learner {

inline Study checked_study(double share = 1) {
  Study study = small_study(30, 2);
  study.recheck = share;
  return study;
}

/// So many sound workers of ids 1, 2, ..., each on a host of its own.
inline void add_workers(Cluster& cluster, int count) {
  for (int id = 1; id <= count; ++id) cluster.add_worker(id).host = "host" + std::to_string(id);
}

inline bool is_said(const Cluster& cluster, const std::string& words) {
  return std::ranges::any_of(
      cluster.log, [&](const LogLine& line) { return line.text.find(words) != std::string::npos; });
}

inline const RecheckRecord& record_of(const Cluster& cluster) {
  return cluster.core->workforce().rechecks().record();
}

}  // namespace treeroll::learner
