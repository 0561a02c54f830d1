// The worked example of learner/journal/README.md is what the code writes.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "learner/journal/journal_record.h"

namespace treeroll {
namespace {

std::string hex(std::string_view bytes) {
  std::string text;
  for (const char byte : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  return text;
}

/// Bytes of a record as the README sets them out: a line a group of fields.
std::string lines_of(const std::string& bytes, std::initializer_list<std::size_t> lengths) {
  std::string text;
  std::size_t at = 0;
  for (const std::size_t length : lengths) {
    text += fmt::format("{:2} {}\n", at, hex(std::string_view(bytes).substr(at, length)));
    at += length;
  }
  EXPECT_EQ(at, bytes.size());
  return text;
}

TEST(JournalRecordTest, AResultKeepsItsReasonAndADiscardedTrialIsOne) {
  for (const Outcome& outcome :
       {Outcome::failed(RolloutStatus::kDiverged, "the rate of link 2 is not finite"),
        Outcome::failed(RolloutStatus::kFailed, std::string(kOutcomeReasonBytesMax, 'x')),
        Outcome::failed(RolloutStatus::kCrashed), Outcome::discarded("caught")}) {
    std::uint64_t check = 0;
    const AcceptedResult result{.key = {.run = 2, .number = -2}, .outcome = outcome};
    const std::string bytes = frame(result, 1, 0, 0, check);
    EXPECT_EQ(bytes.size(), framed_size(result));
    const Result<FramedRecord> read = unframe(bytes);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->record, JournalRecord(result));
  }
}

TEST(WorkedExampleTest, IsWhatTheCodeWrites) {
  std::uint64_t check = 0;
  const std::string start = frame(JournalStart{.algorithm_version = 2,
                                               .study_id = content_hash("[study]\n"),
                                               .learner_id = 258,
                                               .format = 2,
                                               .program = "0.2.0"},
                                  0, 1'000'000, 0, check);
  const std::string worker =
      frame(KnownWorker{.worker_id = 4660, .numeric_class = "x86_64", .host = "vm", .pid = 31488},
            1, 2'000'000, check, check);
  const std::string result = frame(AcceptedResult{.key = {.run = 2, .number = 7},
                                                  .content = 9,
                                                  .outcome = Outcome::ok(.5),
                                                  .worker_id = 4660,
                                                  .duration_ns = 2'000'000},
                                   2, 2'000'000, check, check);
  const std::string time =
      frame(LearningTime{.elapsed = std::chrono::seconds(1)}, 3, 2'500'000, check, check);
  const std::string seal = frame(JournalSeal{}, 4, 3'000'000, check, check);
  const std::string example =
      lines_of(start, {4, 8, 8, 4, 4, 16, 1, 4, 16, 8, 4, 1, 5, 8, 8}) + "\n" +
      lines_of(worker, {4, 8, 8, 4, 4, 16, 1, 8, 4, 1, 6, 1, 2, 8, 8}) + "\n" +
      lines_of(result, {4, 8, 8, 4, 4, 16, 1, 4, 4, 8, 8, 1, 8, 8, 8, 8}) + "\n" +
      lines_of(time, {4, 8, 8, 4, 4, 16, 1, 8, 8, 8}) + "\n" +
      lines_of(seal, {4, 8, 8, 4, 4, 16, 1, 8, 8});
  std::ifstream file(TREEROLL_SOURCE_DIR "/learner/journal/README.md");
  std::string bytes_only;  // without what the lines say of them
  for (std::string line; std::getline(file, line);) {
    bytes_only += line.substr(0, line.find("  ", 3)) + "\n";
  }
  EXPECT_THAT(bytes_only, testing::HasSubstr(example));
}

}  // namespace
}  // namespace treeroll
