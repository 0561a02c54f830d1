#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "learner/journal/journal_record.h"

namespace treeroll {

/// Where a journal's results come from: gathered record by record.
class JournalOrigins {
 public:
  void add(const JournalRecord& record);

  /// The versions of the programs that wrote it; "0.1.0" for one that did not say so.
  const std::set<std::string>& programs() const { return programs_; }
  /// Results by the numeric class of their workers; "" where the journal does not say it.
  const std::map<std::string, std::int64_t>& results_by_class() const { return results_; }

 private:
  std::set<std::string> programs_;
  std::map<protocol::WorkerId, std::string> classes_;
  std::map<std::string, std::int64_t> results_;
};

/// "x86_64 glibc 2.36 (480), aarch64 glibc 2.31 (20)", the most frequent first: for a person, the
/// names without what a terminal would take for more.
std::string class_list(const std::map<std::string, std::int64_t>& results_by_class);

}  // namespace treeroll
