#include "learner/journal/journal_fold.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "tests/files/scratch_folder.h"
#include "tests/journal/learnt_study.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using testing::EndsWith;
using testing::HasSubstr;

class JournalFoldTest : public testing::Test {
 protected:
  JournalFoldTest() { std::ofstream(folder_ / "study.toml") << study_test::tree_study(""); }

  std::string error_of(const fs::path& journal) const {
    const Study study = load_study(folder_ / "study.toml", {}).study;
    learner::LearnerCore core(study, learner::LearnerSettings{});
    try {
      fold_journal(journal, {.id = {}, .repetitions = study.repetitions}, TimePoint{}, core);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "folded";
  }

  static std::string key_of(const NumberedRecord& each) {
    const auto* result = std::get_if<AcceptedResult>(&each.record);
    const std::string kind = std::to_string(each.record.index());
    return result ? kind + " " + std::to_string(result->key.run) + ":" +
                        std::to_string(result->key.number)
                  : kind;
  }

  ScratchFolder scratch_;
  fs::path folder_ = scratch_.path();
};

/// As a reader sees it that comes between any two writes: cut anywhere, also within a record.
TEST_F(JournalFoldTest, OneThatGrowsIsFoldedPartByPartToTheSame) {
  const fs::path learnt = folder_ / "learnt";
  study_test::learn_into(learnt, study_test::tree_study(""));
  const std::string whole = read_whole_file(learnt / "journal.lcmlog");
  const LoadedStudy loaded = load_study(learnt / "study.toml", {});
  const StudyInJournal known{.id = content_hash(loaded.text),
                             .repetitions = loaded.study.repetitions};
  const fs::path growing = folder_ / "growing";
  const auto leave = [&](std::size_t size) {
    std::ofstream(growing, std::ios::binary) << whole.substr(0, size);
  };
  // Contents of answers are no matter here, and learn_into() writes none: records are compared.
  std::vector<std::string> at_once;
  read_numbered(learnt / "journal.lcmlog", known, loaded.study.repetitions,
                [&](const NumberedRecord& each) { at_once.push_back(key_of(each)); });
  for (const std::size_t step : {37U, 200U, 1000U}) {
    std::vector<std::string> in_parts;
    leave(step);
    NumberedReader reader(growing, known, loaded.study.repetitions);
    JournalTail tail;
    for (std::size_t size = step; size < whole.size() + step; size += step) {
      leave(std::min(size, whole.size()));
      tail = reader.read([&](const NumberedRecord& each) { in_parts.push_back(key_of(each)); });
    }
    EXPECT_EQ(in_parts, at_once);
    EXPECT_TRUE(tail.sealed);
    EXPECT_EQ(tail.torn_bytes, 0U);
    EXPECT_EQ(tail.intact_bytes, whole.size());
  }
}

/// Both forms that version 0.1.0 of treeroll and what came before 0.2.0 have written, and a later.
TEST_F(JournalFoldTest, AnotherVersionOfTheAlgorithmIsNamedWithTheProgramThatGoesOn) {
  const auto error_with = [this](const JournalStart& start) {
    const fs::path journal = folder_ / "versions";
    fs::remove(journal);
    JournalWriter writer(journal);
    writer.append(start, 0);
    writer.flush();
    return error_of(journal);
  };
  EXPECT_EQ(error_with({}), "folded");
  EXPECT_THAT(error_with({.algorithm_version = 1, .format = 1}),
              HasSubstr("was written by version 1 of the algorithm, this program has version 2, "
                        "which gives other bits: go on with treeroll 0.1.0, or learn its "
                        "study.toml anew"));
  EXPECT_THAT(error_with({.algorithm_version = 1, .program = "0.1.7"}),
              HasSubstr("go on with treeroll 0.1.7, or"));
  EXPECT_THAT(error_with({.algorithm_version = 3, .program = "0.9"}),
              HasSubstr("version 3 of the algorithm, this program has version 2, which gives other "
                        "bits: go on with treeroll 0.9, or"));
}

TEST_F(JournalFoldTest, SalvageIsAdvisedOfDamageNotOfWhatCannotBeRead) {
  const fs::path journal = folder_ / "journal";
  EXPECT_EQ(error_of(journal), journal.string() + ": No such file or directory");
  EXPECT_EQ(error_of(folder_), folder_.string() + ": it cannot be read to its end");
  {
    JournalWriter writer(journal);
    for (int i = 0; i < 3; ++i) writer.append(JournalStart{}, 0);
    writer.flush();
  }
  EXPECT_EQ(error_of(journal), "folded");
  std::fstream bytes(journal, std::ios::binary | std::ios::in | std::ios::out);
  bytes.seekp(static_cast<std::streamoff>(fs::file_size(journal) / 2));
  bytes.put('x');
  bytes.close();
  EXPECT_THAT(error_of(journal), HasSubstr("record 1 at byte"));
  EXPECT_THAT(error_of(journal),
              EndsWith("(treeroll-learner --resume DIR --salvage keeps what is before)"));
}

}  // namespace
}  // namespace treeroll
