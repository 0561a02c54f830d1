#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>

#include "learner/journal/background_sync.h"
#include "learner/journal/journal_record.h"

namespace treeroll {

/// What reading a journal has found.
struct JournalTail {
  std::int64_t num_records = 0;  ///< intact ones
  std::uint64_t last_check = 0;  ///< of the last of them
  std::uint64_t intact_bytes = 0;
  std::uint64_t torn_bytes = 0;      ///< behind them, no valid record among them
  bool torn_bytes_are_zero = false;  ///< all of them: what a host leaves that lost power
  bool sealed = false;               ///< the last record is a seal
};

/// Reads a journal from its start and gives each record to `on_record`.
/// What a crash leaves, a tail without any valid record in it, is reported in the result. Damage
/// with valid records behind it, a seal that does not verify, records out of order, a first
/// record or one behind a seal that is no start, are errors that
/// name file, record and offset; so is a file without a record that is longer than what a crash
/// leaves of the first. Throws std::runtime_error for a start of a later form than this program
/// knows, which is no damage. Whatever `on_record` throws passes through.
Result<JournalTail> read_journal(const std::filesystem::path& path,
                                 const std::function<void(const JournalRecord&)>& on_record);
/// Where a record stands. Not what writing it anew would take: what was read may be longer.
struct RecordPlace {
  std::int64_t number = 0;
  std::uint64_t begin = 0;        ///< its first byte
  std::uint64_t end = 0;          ///< the byte behind it
  std::int64_t wall_time_us = 0;  ///< when it was written, since 1970
};
/// The same of bytes that may be no file. `name` stands for the path in errors.
/// @param from  what was read before: goes on behind it, as a learner has written more
Result<JournalTail> read_journal_places(
    std::istream& bytes, const std::string& name,
    const std::function<void(const JournalRecord&, const RecordPlace&)>& on_record,
    const JournalTail& from = {});
Result<JournalTail> read_journal(std::istream& bytes, const std::string& name,
                                 const std::function<void(const JournalRecord&)>& on_record);

/// For a record that is written now: microseconds since 1970.
std::int64_t wall_time_now_us();

/// Appends records. write(2) at each flush, so that nothing waits in this process; sync() makes
/// them last. Every failing call throws std::runtime_error with path and reason: a learner that
/// cannot write must stop. So does one whose journal another process has cut, changed, deleted or
/// moved: nobody could go on from it. One thread.
class JournalWriter {
 public:
  /// Opens or makes the journal and takes a lock that the kernel releases when the process ends;
  /// throws if another learner holds it.
  explicit JournalWriter(std::filesystem::path path);
  ~JournalWriter();
  JournalWriter(const JournalWriter&) = delete;
  JournalWriter& operator=(const JournalWriter&) = delete;

  /// Goes on behind what has been read of the journal since it was opened; a torn tail is cut off.
  void continue_after(const JournalTail& tail);
  void append(const JournalRecord& record, std::int64_t wall_time_us);
  void flush();
  /// flush() and fdatasync(2).
  void sync();
  /// The same without waiting for the disk. Precondition: none is under way.
  void begin_sync();
  /// A descriptor that is readable from when the sync that was begun is done until end_sync().
  int sync_done() const { return background_.done(); }
  /// Waits for the sync that was begun. Precondition: one is under way.
  void end_sync();

 private:
  [[noreturn]] void fail(const char* action) const;
  void check_length() const;
  void check_name() const;

  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;  ///< as this has left the file
  std::int64_t next_number_ = 0;
  std::uint64_t last_check_ = 0;
  std::string buffer_;
  bool has_unsynced_ = false;
  BackgroundSync background_;
};

}  // namespace treeroll
