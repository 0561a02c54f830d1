#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "learner/journal/journal_file.h"
#include "tests/simulation/dice.h"

namespace treeroll::simulation {

/// The journal of one learner, byte by byte as the shipped code frames and reads it, and how much
/// of it a crash leaves. The three places of a record: this process, the kernel, the disk.
class Disk {
 public:
  /// What read_journal() does with the file, and JournalWriter::continue_after(). The error's
  /// message, or nothing.
  std::string open(const std::function<void(const JournalRecord&)>& on_record);
  void append(const JournalRecord& record);
  void flush();  ///< write(2)
  void sync();   ///< fdatasync(2), with what has been appended
  void begin_sync();
  void end_sync();  ///< what was written by then will last; what has been written since may not
  bool has_unsynced() const { return num_synced_ < bytes_.size(); }

  /// The process ends, perhaps within write(2); perhaps with its host, so that of what was not
  /// synced some is lost from any byte on, or reads as zeros.
  enum class Loss { kNothing, kTorn, kZeros };
  Loss crash(Dice& dice);

  /// All records, or nothing if the journal does not end with a seal.
  std::optional<std::vector<JournalRecord>> records() const;

 private:
  std::string bytes_;
  std::string buffer_;
  std::size_t num_synced_ = 0;   ///< bytes
  std::size_t num_syncing_ = 0;  ///< bytes that will be once the sync has ended
  std::int64_t next_number_ = 0;
  std::uint64_t last_check_ = 0;
};

}  // namespace treeroll::simulation
