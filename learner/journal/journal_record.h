#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "common/base/content_hash.h"
#include "common/base/result.h"
#include "common/protocol/limits.h"
#include "common/task_facts/task_description.h"
#include "learner/core/accepted_result.h"
#include "learner/core/known_worker.h"
#include "learner/core/learning_time.h"
#include "learner/core/task_signals.h"

namespace treeroll {

/// Raised by each release that changes drawing, updating or the bits of rewards: an older journal
/// would fold to other bits. 1 is that of version 0.1.0; 2, of 0.2.0, has sin, cos and exp of its
/// own (common/numbers/elementary.h).
inline constexpr std::uint32_t kAlgorithmVersion = 2;

/// The latest form of records. 1 is that of version 0.1.0: its starts name no form and no program,
/// and it has no records of workers. 3 has second answers beside 2, 4 names of signals. A journal
/// may go on in a later form than it begins with.
inline constexpr std::uint32_t kJournalFormat = 4;
/// Of a study that has nothing which needs a later one: older programs read it.
inline constexpr std::uint32_t kCommonJournalFormat = 2;
/// Of one whose roll-outs are run again.
inline constexpr std::uint32_t kRecheckJournalFormat = 3;
inline constexpr std::size_t kProgramBytesMax = 64;

/// What the journal says, record by record.

/// A learner has begun to write, the first or after an interruption.
struct JournalStart {
  std::uint32_t algorithm_version = kAlgorithmVersion;
  ContentHash study_id = {};  ///< of the resolved study's text
  std::int64_t learner_id = 0;
  std::uint32_t format = kCommonJournalFormat;  ///< of the records from here on
  std::string program = {};  ///< version of the learner, at most kProgramBytesMax
  bool operator==(const JournalStart&) const = default;
};

/// A clean end: everything before it is as it was meant.
struct JournalSeal {
  bool operator==(const JournalSeal&) const = default;
};

/// From here on a study that has been extended is learnt: more roll-outs, more repetitions or more
/// time. Stands behind the start of the learner that was given the extension.
struct JournalExtension {
  ContentHash study_id_before;          ///< of the study's text until now
  ContentHash study_id;                 ///< of the text that holds from here on
  std::int32_t repetitions_before = 1;  ///< run r was repetition r % this
  std::int32_t repetitions = 1;         ///< run r is repetition r % this
  bool operator==(const JournalExtension&) const = default;
};

using JournalRecord = std::variant<JournalStart, AcceptedResult, SecondAnswer, LearningTime,
                                   KnownWorker, TaskSignals, JournalExtension, JournalSeal>;

/// A record as an event of LCM's log format, on channel kJournalChannel:
///
///   offset  size  big-endian, as LCM writes its logs
///        0     4  sync word 0xeda1da01
///        4     8  number of the record: 0, 1, ...
///       12     8  wall time, us since 1970
///       20     4  length of the channel, 16
///       24     4  length of the data
///       28    16  "TREEROLL_JOURNAL"
///       44     1  kind: 1 start, 2 result, 3 seal, 4 time, 16 extension, 17 worker,
///                       18 second answer, 19 names of signals
///       45        start:  version 4, study 16, learner 8; from form 2 on form 4, program text
///                 result: run 4, number 4, content 8, reward 8 (IEEE 754), status 1, worker 8;
///                         from form 2 on duration 8, ns, -1 if unknown, and the reason, if its
///                         status is not ok: at most 256 bytes
///                 second answer: as a result of form 2
///                 time:   elapsed 8, ns of learning up to here
///                 extension: study before 16, study 16, repetitions before 4, repetitions 4
///                 worker: worker 8, pid 4, numeric class text, host text
///                 names of signals: task 16, number of inputs 2, of outputs 2, a text of each;
///                         at most kTaskReportBytesMax, as the worker's report that told them
///                 A text is its length, 1, and its bytes.
///      -16     8  check of the record before it, 0 for the first
///       -8     8  check of this record: the first 8 bytes of the BLAKE2b hash (128 bits) of all of
///                 it up to here, in reverse order, so that each verifies alone and the order is
///                 fixed
inline constexpr std::string_view kJournalSyncBytes = "\xed\xa1\xda\x01";
inline constexpr const char* kJournalChannel = "TREEROLL_JOURNAL";
inline constexpr std::size_t kJournalRecordBytesMax = 28 + 16 + 1 + kTaskReportBytesMax + 16;
static_assert(41 + kOutcomeReasonBytesMax <= kTaskReportBytesMax);

struct FramedRecord {
  JournalRecord record;
  std::int64_t number = 0;
  std::int64_t wall_time_us = 0;  ///< since 1970, when it was written
  std::uint64_t check_before = 0;
  std::uint64_t check = 0;
  std::size_t size = 0;  ///< bytes of the event
};

/// @return the bytes; `check` receives the record's check, for the next one
std::string frame(const JournalRecord& record, std::int64_t number, std::int64_t wall_time_us,
                  std::uint64_t check_before, std::uint64_t& check);

/// Bytes of its event.
std::size_t framed_size(const JournalRecord& record);

/// Reads the event at the start of `bytes`, which may hold more or less than one. An error says
/// what is wrong with it; nothing of it may be used then.
Result<FramedRecord> unframe(std::string_view bytes);

}  // namespace treeroll
