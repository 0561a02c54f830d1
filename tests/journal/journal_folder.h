#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "learner/journal/journal_file.h"
#include "tests/files/scratch_folder.h"

namespace treeroll {

/// A journal in a folder of its own, and its bytes.
class JournalFolderTest : public ::testing::Test {
 protected:
  static constexpr LearningTime kTime{std::chrono::milliseconds(1234)};

  const KnownWorker kWorker{77, "x86_64 glibc 2.36", "host"};

  static AcceptedResult result(int number) {
    return {{1, number}, 1000 + number, Outcome::ok(number / 8.), 77};
  }

  /// A start, results 0 .. n-1, a time, and a seal if wanted; its bytes.
  std::string write(int num_results, bool sealed) {
    {
      JournalWriter writer(path());
      writer.continue_after({});
      writer.append(JournalStart{.program = "0.2.0"}, 5);
      for (int number = 0; number < num_results; ++number) writer.append(result(number), 6);
      writer.append(kTime, 7);
      if (sealed) writer.append(JournalSeal{}, 7);
      writer.sync();
    }
    std::ifstream file(path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  void replace(const std::string& bytes) {
    std::ofstream(path(), std::ios::binary | std::ios::trunc) << bytes;
  }

  Result<JournalTail> read() {
    records_.clear();
    return read_journal(path(),
                        [this](const JournalRecord& record) { records_.push_back(record); });
  }

  std::filesystem::path path() const { return directory_ / "journal.lcmlog"; }

  ScratchFolder scratch_;
  std::filesystem::path directory_ = scratch_.path();
  std::vector<JournalRecord> records_;
};

}  // namespace treeroll
