#include "tests/simulation/disk.h"

#include <algorithm>
#include <sstream>

#include "tests/simulation/planted_fault.h"

namespace treeroll::simulation {

std::string Disk::open(const std::function<void(const JournalRecord&)>& on_record) {
  std::istringstream file(bytes_);
  const Result<JournalTail> tail = read_journal(file, "journal", on_record);
  if (!tail) return tail.error().message;
  bytes_.resize(tail->intact_bytes);
  num_synced_ = std::min(num_synced_, bytes_.size());
  next_number_ = tail->num_records;
  last_check_ = tail->last_check;
  return "";
}

void Disk::append(const JournalRecord& record) {
  buffer_ += frame(record, next_number_++, 0, last_check_, last_check_);
}

void Disk::flush() {
  bytes_ += buffer_;
  buffer_.clear();
}

void Disk::sync() {
  begin_sync();
  end_sync();
}

void Disk::begin_sync() {
  flush();
  num_syncing_ = bytes_.size();
}

void Disk::end_sync() { num_synced_ = num_syncing_; }

Disk::Loss Disk::crash(Dice& dice) {
  if (dice.chance(.5)) {
    bytes_ += buffer_.substr(
        0, static_cast<std::size_t>(dice.between(0, static_cast<int>(buffer_.size()))));
  }
  buffer_.clear();
  if (!has_unsynced() || dice.chance(.4)) return Loss::kNothing;
  const std::size_t size = bytes_.size();
  bytes_.resize(static_cast<std::size_t>(
      dice.between(static_cast<int>(num_synced_), static_cast<int>(size))));
  if (bytes_.size() == size) return Loss::kNothing;
  if (!dice.chance(.2)) return Loss::kTorn;
  bytes_.resize(size, '\0');
  return Loss::kZeros;
}

std::optional<std::vector<JournalRecord>> Disk::records() const {
  const WithoutFault without_fault;
  std::vector<JournalRecord> records;
  std::istringstream file(bytes_);
  const auto tail = read_journal(
      file, "journal", [&records](const JournalRecord& record) { records.push_back(record); });
  if (!tail || tail->torn_bytes > 0 || !tail->sealed) return std::nullopt;
  return records;
}

}  // namespace treeroll::simulation
