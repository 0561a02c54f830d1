#include "learner/journal/journal_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>

#include "learner/journal/journal_fold.h"
#include "learner/journal/journal_origins.h"
#include "tests/journal/journal_folder.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class JournalFileTest : public JournalFolderTest {};

TEST_F(JournalFileTest, EveryKindOfRecordComesBack) {
  AcceptedResult timed = result(2);
  timed.duration_ns = 123'456'789;
  AcceptedResult failed = result(3);
  failed.outcome = {0, RolloutStatus::kDiverged, "NaN"};
  AcceptedResult failed_and_timed = failed;
  failed_and_timed.duration_ns = 5;
  const std::vector<JournalRecord> records = {
      JournalStart{.study_id = content_hash("a"), .learner_id = 3},
      JournalExtension{content_hash("a"), content_hash("b"), 2, 5},
      KnownWorker{.worker_id = 77, .numeric_class = "x86_64 fma", .host = "h\xc3\xb6st", .pid = 12},
      KnownWorker{.worker_id = 78, .numeric_class = "", .host = "", .pid = 13},
      result(1),  // as an earlier version wrote it
      timed,
      failed,
      failed_and_timed,
      SecondAnswer{timed},
      TaskSignals{content_hash("task"), {{"angle_rad", "h\xc3\xb6he_m"}, {"torque_nm"}}},
      kTime,
      JournalSeal{}};
  {
    JournalWriter writer(path());
    writer.continue_after({});
    for (const JournalRecord& record : records) writer.append(record, 1);
    writer.flush();
  }
  const Result<JournalTail> tail = read();
  ASSERT_TRUE(tail) << tail.error().message;
  EXPECT_EQ(records_, records);
  std::size_t bytes = 0;
  for (const JournalRecord& record : records) bytes += framed_size(record);
  EXPECT_EQ(bytes, tail->intact_bytes);
}

TEST_F(JournalFileTest, LongNamesOfAWorkerAreCutAndFit) {
  std::uint64_t check = 0;
  const std::string bytes = frame(KnownWorker{.worker_id = 1,
                                              .numeric_class = std::string(5000, 'c'),
                                              .host = std::string(5000, 'h'),
                                              .pid = 2},
                                  0, 0, 0, check);
  EXPECT_LE(bytes.size(), kJournalRecordBytesMax);
  const Result<FramedRecord> framed = unframe(bytes);
  ASSERT_TRUE(framed) << framed.error().message;
  EXPECT_EQ(std::get<KnownWorker>(framed->record).numeric_class, std::string(128, 'c'));
}

TEST_F(JournalFileTest, TheMostNamesThatAWorkerCanReportFit) {
  SignalNames names;
  std::size_t longest = 0;
  for (int i = 0;; ++i) {
    names.inputs.push_back("x" + std::to_string(i));
    names.outputs = {"y"};
    TaskDescription task{.input_dim = i + 1, .output_dim = 1, .time_limit_s = 1, .signals = names};
    const Result<TaskDescription> read = task_description_from_json(report_text(task));
    ASSERT_TRUE(read);
    if (read->signals.empty()) break;
    std::uint64_t check = 0;
    const std::string bytes = frame(TaskSignals{{}, names}, 0, 0, 0, check);
    longest = bytes.size();
    ASSERT_LE(longest, kJournalRecordBytesMax);
    ASSERT_TRUE(unframe(bytes));
  }
  EXPECT_GT(longest, 500U);
}

TEST_F(JournalFileTest, NamesThatAreNotWholeOrNoNamesAreNoRecord) {
  const auto error_of = [](const SignalNames& names) {
    std::uint64_t check = 0;
    const Result<FramedRecord> framed = unframe(frame(TaskSignals{{}, names}, 0, 0, 0, check));
    return framed ? "" : framed.error().message;
  };
  EXPECT_EQ(error_of({{"a"}, {"b"}}), "");
  EXPECT_THAT(error_of({}), HasSubstr("not whole"));
  EXPECT_THAT(error_of({{"a", "a"}, {"b"}}), HasSubstr("each name must be there once"));
  EXPECT_THAT(error_of({{"a b"}, {"c"}}), HasSubstr("inputs: the name 'a b'"));
  EXPECT_THAT(error_of({{"\x1b[31m"}, {"c"}}), HasSubstr("inputs: the name ' [31m'"));
  EXPECT_THAT(error_of({{std::string(200, 'a')}, {"c"}}), HasSubstr("not whole"));
}

TEST_F(JournalFileTest, AnExtensionToFewerRepetitionsIsNoRecord) {
  std::uint64_t check = 0;
  const std::string bytes = frame(JournalExtension{{}, {}, 3, 2}, 0, 0, 0, check);
  const Result<FramedRecord> framed = unframe(bytes);
  ASSERT_FALSE(framed);
  EXPECT_EQ(framed.error().message, "an extension from 3 repetitions to 2");
}

TEST_F(JournalFileTest, GivesBackWhatWasWritten) {
  write(3, true);
  const Result<JournalTail> tail = read();
  ASSERT_TRUE(tail);
  EXPECT_TRUE(tail->sealed);
  EXPECT_EQ(tail->torn_bytes, 0U);
  ASSERT_EQ(records_.size(), 6U);
  EXPECT_EQ(records_[4], JournalRecord(kTime));
  EXPECT_EQ(records_[0], JournalRecord(JournalStart{.program = "0.2.0"}));
  for (int number = 0; number < 3; ++number) {
    EXPECT_EQ(records_[number + 1], JournalRecord(result(number)));
  }
}

TEST_F(JournalFileTest, TheSizeOfARecordIsThatOfItsEvent) {
  std::uint64_t check = 0;
  for (const JournalRecord& record :
       {JournalRecord(JournalStart{}), JournalRecord(JournalStart{.program = "0.2.0"}),
        JournalRecord(result(1)), JournalRecord(kTime), JournalRecord(kWorker),
        JournalRecord(JournalSeal{})}) {
    EXPECT_EQ(framed_size(record), frame(record, 0, 0, 0, check).size());
  }
}

TEST_F(JournalFileTest, EveryTruncationKeepsTheWholeRecordsAndGoesOnBehindThem) {
  const std::string whole = write(3, false);
  std::vector<std::size_t> ends{0};  // of records
  for (std::size_t place = 0; place < whole.size();) {
    const Result<FramedRecord> framed = unframe(std::string_view(whole).substr(place));
    ASSERT_TRUE(framed);
    ends.push_back(place += framed->size);
  }
  for (std::size_t size = 0; size < whole.size(); ++size) {
    replace(whole.substr(0, size));
    const Result<JournalTail> tail = read();
    ASSERT_TRUE(tail) << size << ": " << tail.error().message;
    std::size_t kept = 0;
    while (ends[kept + 1] <= size) ++kept;
    EXPECT_EQ(records_.size(), kept) << size;
    EXPECT_EQ(tail->torn_bytes, size - ends[kept]) << size;

    JournalWriter writer(path());
    writer.continue_after(*tail);
    const JournalRecord next = kept == 0 ? JournalRecord(JournalStart{}) : JournalRecord(result(9));
    writer.append(next, 8);
    writer.sync();
    ASSERT_TRUE(read());
    ASSERT_EQ(records_.size(), kept + 1);
    EXPECT_EQ(records_.back(), next);
  }
}

TEST_F(JournalFileTest, EveryFlippedBitOfASealedJournalIsDetected) {
  const std::string whole = write(2, true);
  for (std::size_t byte = 0; byte < whole.size(); ++byte) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string flipped = whole;
      flipped[byte] = static_cast<char>(flipped[byte] ^ (1 << bit));
      replace(flipped);
      const Result<JournalTail> tail = read();
      ASSERT_FALSE(tail) << "byte " << byte << " bit " << bit;
      EXPECT_THAT(tail.error().message, HasSubstr(path().string() + ": record "));
    }
  }
}

TEST_F(JournalFileTest, RecordsTakenOutOrMovedAreDetected) {
  const std::string whole = write(4, true);
  const std::size_t start = unframe(whole)->size;
  const std::size_t size = unframe(std::string_view(whole).substr(start))->size;
  replace(whole.substr(0, start) + whole.substr(start + size));
  EXPECT_FALSE(read());
  replace(whole.substr(0, start) + whole.substr(start + size, size) + whole.substr(start, size) +
          whole.substr(start + 2 * size));
  EXPECT_FALSE(read());
}

TEST_F(JournalFileTest, WhatIsNoJournalIsNoTornTail) {
  const std::size_t start =
      framed_size(JournalStart{.program = std::string(kProgramBytesMax, 'x')});
  replace(std::string(start, '\0'));  // a crash can leave as much of the first record
  EXPECT_TRUE(read());
  for (const std::string& bytes : {std::string(start + 1, '\0'), std::string(100'000, 'x')}) {
    replace(bytes);
    const Result<JournalTail> tail = read();
    ASSERT_FALSE(tail);
    EXPECT_THAT(tail.error().message, HasSubstr("is no journal: not one record is in its"));
  }
}

TEST_F(JournalFileTest, AJournalOfTheFirstFormIsReadAndGoesOnInThisOne) {
  const std::vector<JournalRecord> records{JournalStart{.learner_id = 3, .format = 1}, result(0),
                                           JournalStart{.learner_id = 4, .program = "0.2.0"},
                                           kWorker, result(1)};
  JournalWriter writer(path());
  for (const JournalRecord& record : records) writer.append(record, 1);
  writer.sync();
  ASSERT_TRUE(read());
  EXPECT_EQ(records_, records);
  // As 0.1.0 wrote a start: 28 bytes behind its kind.
  EXPECT_EQ(framed_size(records[0]), 28U + 16 + 1 + 28 + 16);
  JournalOrigins origins;
  for (const JournalRecord& record : records_) origins.add(record);
  EXPECT_EQ(origins.programs(), (std::set<std::string>{"0.1.0", "0.2.0"}));
  EXPECT_EQ(class_list(origins.results_by_class()), "not known (1), x86_64 glibc 2.36 (1)");
}

TEST_F(JournalFileTest, AProgramThatWouldSteerATerminalIsShownWithout) {
  std::uint64_t check = 0;
  const std::string bytes = frame(JournalStart{.program = "1\x1b[2J\n\x7f\xc3"}, 0, 0, 0, check);
  const Result<FramedRecord> framed = unframe(bytes);
  ASSERT_TRUE(framed);
  EXPECT_EQ(std::get<JournalStart>(framed->record).program, "1?[2J???");
}

/// A result may hold a duration that is not known, which our writer leaves out.
TEST_F(JournalFileTest, RecordsAreAsLongAsTheyStandInTheFile) {
  std::uint64_t check = 0;
  std::string bytes = frame(JournalStart{}, 0, 0, 0, check);
  AcceptedResult timed = result(0);
  timed.duration_ns = 1;
  std::uint64_t ignored = 0;
  std::string longer = frame(timed, 1, 0, check, ignored);
  longer.resize(longer.size() - 24);  // its duration, the check before it and its own
  longer += std::string(8, '\xff') + bytes.substr(bytes.size() - 8);
  std::uint64_t own = static_cast<std::uint64_t>(short_form(content_hash(longer)));
  for (int shift = 56; shift >= 0; shift -= 8) longer += static_cast<char>(own >> shift);
  bytes += longer;
  const std::string intact = bytes + frame(result(1), 2, 0, own, own);
  const std::string last = frame(result(2), 3, 0, own, own);
  std::string damaged = frame(result(2), 3, 0, own, own);
  damaged[50] ^= 1;
  replace(intact + damaged + last);
  const Salvaged salvaged = salvage_journal(path());
  EXPECT_EQ(salvaged.num_records, 3);
  EXPECT_EQ(salvaged.bytes_kept, intact.size());
  std::ifstream file(path(), std::ios::binary);
  EXPECT_EQ((std::string{std::istreambuf_iterator<char>(file), {}}), intact);
  EXPECT_TRUE(read());
}

TEST_F(JournalFileTest, ALaterFormIsNamedWithItsProgramAndIsNoDamage) {
  write(2, false);
  const Result<JournalTail> tail = read();
  ASSERT_TRUE(tail);
  JournalWriter writer(path());
  writer.continue_after(*tail);
  writer.append(JournalStart{.format = 9, .program = "7.1"}, 8);
  writer.sync();
  const auto error_of = [](const auto& act) -> std::string {
    try {
      act();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "none";
  };
  const std::string expected =
      path().string() + ": record 4 at byte " + std::to_string(tail->intact_bytes) +
      ": from here on it is written in form 9 by treeroll 7.1, and this program reads forms up to "
      "4: take that version";
  EXPECT_EQ(error_of([this] { (void)read(); }), expected);
  // Salvage would cut off what is whole.
  const auto size = fs::file_size(path());
  EXPECT_EQ(error_of([this] { (void)salvage_journal(path()); }), expected);
  EXPECT_EQ(fs::file_size(path()), size);
}

TEST_F(JournalFileTest, BeginsWithAStartAndGoesOnWithOneBehindASeal) {
  const auto error_of = [this](const std::vector<JournalRecord>& records) -> std::string {
    fs::remove(path());
    JournalWriter writer(path());
    for (const JournalRecord& record : records) writer.append(record, 1);
    writer.sync();
    const Result<JournalTail> tail = read();
    return tail ? "" : tail.error().message;
  };
  const JournalStart start;
  const JournalSeal seal;
  EXPECT_EQ(error_of({start, result(0), seal, start, result(1), start, result(2), seal}), "");
  EXPECT_THAT(error_of({result(0)}), HasSubstr("record 0 at byte 0: a start must stand here"));
  EXPECT_THAT(error_of({start, seal, result(0)}), HasSubstr("record 2"));
  EXPECT_THAT(error_of({start, seal, seal}), HasSubstr("a start must stand here"));
}

TEST_F(JournalFileTest, ARewardThatNoTaskCanGiveIsDamage) {
  for (const double reward : {-.5, std::nan(""), HUGE_VAL}) {
    AcceptedResult impossible = result(1);
    impossible.outcome = Outcome::ok(reward);
    std::uint64_t check = 0;
    EXPECT_FALSE(unframe(frame(impossible, 0, 0, 0, check))) << reward;
  }
}

TEST_F(JournalFileTest, ATailOfZerosIsToldFromOtherTails) {
  const std::string bytes = write(3, false);
  for (const std::size_t num_zeros : {1U, 60U, 65'535U, 65'536U, 300'000U}) {
    replace(bytes + std::string(num_zeros, '\0'));
    const Result<JournalTail> tail = read();
    ASSERT_TRUE(tail);
    EXPECT_EQ(tail->torn_bytes, num_zeros);
    EXPECT_TRUE(tail->torn_bytes_are_zero);
    replace(bytes + std::string(num_zeros, '\0') + "x");
    EXPECT_FALSE(read()->torn_bytes_are_zero);
    // Behind them a whole record: that is damage, wherever it stands to the blocks that are read.
    replace(bytes + std::string(num_zeros, '\0') + bytes);
    ASSERT_FALSE(read());
    EXPECT_THAT(read().error().message, HasSubstr("a valid record follows at byte " +
                                                  std::to_string(bytes.size() + num_zeros)));
  }
}

}  // namespace
}  // namespace treeroll
