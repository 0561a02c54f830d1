#include "learner/journal/journal_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <utility>

namespace treeroll {
namespace {

constexpr std::size_t kBlockBytes = 1U << 16U;

/// A window over a stream that is read once from start to end.
class Window {
 public:
  Window(std::istream& file, std::uint64_t offset) : file_(file), offset_(offset) {
    if (offset > 0) file_.seekg(static_cast<std::streamoff>(offset));
  }

  /// What is left from here on: at least `size` bytes unless the file ends before.
  std::string_view ahead(std::size_t size) {
    if (bytes_.size() - place_ < size && file_) {
      bytes_.erase(0, place_);
      place_ = 0;
      const std::size_t before = bytes_.size();
      bytes_.resize(before + kBlockBytes);
      file_.read(bytes_.data() + before, static_cast<std::streamsize>(kBlockBytes));
      bytes_.resize(before + static_cast<std::size_t>(file_.gcount()));
    }
    return std::string_view(bytes_).substr(place_);
  }
  void skip(std::size_t size) {
    place_ += size;
    offset_ += size;
  }
  std::uint64_t offset() const { return offset_; }

 private:
  std::istream& file_;
  std::string bytes_;
  std::size_t place_ = 0;
  std::uint64_t offset_;
};

/// Goes to where a record may begin, the byte it stands at or one behind it.
/// @param only_zeros  set to false if any byte on the way is not 0
/// @return            false at the end
bool skip_to_sync_word(Window& window, bool& only_zeros) {
  for (;;) {
    const std::string_view bytes = window.ahead(kJournalRecordBytesMax);
    if (bytes.empty()) return false;
    const std::size_t found = bytes.find(kJournalSyncBytes);
    // What it begins with may be the end of what is here.
    const std::size_t behind = bytes.size() < kJournalRecordBytesMax
                                   ? bytes.size()
                                   : bytes.size() - (kJournalSyncBytes.size() - 1);
    const std::size_t passed = std::min(found, behind);
    only_zeros = only_zeros && found == std::string_view::npos &&
                 bytes.substr(0, passed).find_first_not_of('\0') == std::string_view::npos;
    window.skip(passed);
    if (found != std::string_view::npos) return true;
  }
}

/// True if the bytes are a seal but for its check and at most one byte of what every seal shares. A
/// record torn to the size of a seal differs in two: the length of its data and its kind.
bool looks_like_a_seal(std::string_view bytes) {
  constexpr std::size_t kNumberAt = 4;
  constexpr std::size_t kLengthsAt = 20;
  constexpr std::size_t kCheckBeforeAt = 45;
  std::uint64_t check = 0;
  const std::string seal = frame(JournalSeal{}, 0, 0, 0, check);
  if (bytes.size() != seal.size()) return false;
  int differing = 0;
  for (std::size_t i = 0; i < kCheckBeforeAt; ++i) {
    const bool shared = i < kNumberAt || i >= kLengthsAt;
    if (shared && bytes[i] != seal[i]) ++differing;
  }
  return differing <= 1;
}

JournalStart longest_start() { return {.program = std::string(kProgramBytesMax, ' ')}; }

}  // namespace

std::int64_t wall_time_now_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

Result<JournalTail> read_journal_places(
    std::istream& file, const std::string& name,
    const std::function<void(const JournalRecord&, const RecordPlace&)>& on_record,
    const JournalTail& from) {
  const auto damaged = [&name](std::int64_t record, std::uint64_t offset, const std::string& what) {
    return Error{fmt::format("{}: record {} at byte {}: {}", name, record, offset, what)};
  };
  Window window(file, from.intact_bytes);
  JournalTail tail = from;
  tail.torn_bytes = 0;
  tail.torn_bytes_are_zero = false;
  while (!window.ahead(kJournalRecordBytesMax).empty()) {
    Result<FramedRecord> framed = unframe(window.ahead(kJournalRecordBytesMax));
    if (!framed) {
      const std::uint64_t offset = window.offset();
      if (looks_like_a_seal(window.ahead(kJournalRecordBytesMax))) {
        return damaged(tail.num_records, offset, "a seal that does not verify");
      }
      tail.torn_bytes_are_zero = true;
      while (skip_to_sync_word(window, tail.torn_bytes_are_zero)) {
        if (unframe(window.ahead(kJournalRecordBytesMax))) {
          return damaged(tail.num_records, offset,
                         fmt::format("{}; it is damaged, for a valid record follows at byte {}",
                                     framed.error().message, window.offset()));
        }
        window.skip(1);
      }
      tail.torn_bytes = window.offset() - offset;
      // The first record is on stable storage before a second one is written.
      if (tail.num_records == 0 && tail.torn_bytes > framed_size(longest_start())) {
        return Error{fmt::format("{}: is no journal: not one record is in its {} bytes", name,
                                 tail.torn_bytes)};
      }
      break;
    }
    if (framed->number != tail.num_records || framed->check_before != tail.last_check) {
      return damaged(tail.num_records, window.offset(), "it does not follow the record before it");
    }
    const auto* start = std::get_if<JournalStart>(&framed->record);
    if (start && start->format > kJournalFormat) {
      // Nothing is damaged: whoever could mend damage must leave it alone.
      throw std::runtime_error(fmt::format(
          "{}: record {} at byte {}: from here on it is written in form {} by treeroll {}, and "
          "this "
          "program reads forms up to {}: take that version",
          name, tail.num_records, window.offset(), start->format, start->program, kJournalFormat));
    }
    const bool begins = tail.num_records == 0 || tail.sealed;
    if (begins && !start) {
      return damaged(tail.num_records, window.offset(), "a start must stand here");
    }
    on_record(framed->record, {tail.num_records, window.offset(), window.offset() + framed->size,
                               framed->wall_time_us});
    ++tail.num_records;
    tail.last_check = framed->check;
    tail.sealed = std::holds_alternative<JournalSeal>(framed->record);
    window.skip(framed->size);
    tail.intact_bytes = window.offset();
  }
  if (file.bad()) return Error{fmt::format("{}: it cannot be read to its end", name)};
  return tail;
}

Result<JournalTail> read_journal(std::istream& file, const std::string& name,
                                 const std::function<void(const JournalRecord&)>& on_record) {
  return read_journal_places(
      file, name,
      [&on_record](const JournalRecord& record, const RecordPlace&) { on_record(record); });
}

Result<JournalTail> read_journal(const std::filesystem::path& path,
                                 const std::function<void(const JournalRecord&)>& on_record) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{fmt::format("{}: {}", path.string(), std::strerror(errno))};
  return read_journal(file, path.string(), on_record);
}

namespace {

/// As a person may act upon it.
[[noreturn]] void refuse_touched(const std::filesystem::path& path, const std::string& what) {
  throw std::runtime_error(fmt::format("{}: another process has {}", path.string(), what));
}

}  // namespace

JournalWriter::JournalWriter(std::filesystem::path path) : path_(std::move(path)) {
  descriptor_ = open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor_ < 0) fail("open");
  if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return;
  const int error = errno;
  close(descriptor_);
  errno = error;
  if (error != EWOULDBLOCK) fail("lock");
  throw std::runtime_error(fmt::format("{}: another learner is writing it", path_.string()));
}

void JournalWriter::continue_after(const JournalTail& tail) {
  next_number_ = tail.num_records;
  last_check_ = tail.last_check;
  if (ftruncate(descriptor_, static_cast<off_t>(tail.intact_bytes)) != 0) fail("cut");
  if (lseek(descriptor_, 0, SEEK_END) < 0) fail("seek");
  size_ = tail.intact_bytes;
}

JournalWriter::~JournalWriter() {
  if (background_.is_under_way()) background_.end();
  if (descriptor_ >= 0) close(descriptor_);
}

void JournalWriter::fail(const char* action) const {
  throw std::runtime_error(
      fmt::format("{}: cannot {} the journal: {}", path_.string(), action, std::strerror(errno)));
}

/// Before each write: what is written behind a cut would be a hole and a record.
void JournalWriter::check_length() const {
  struct stat ours {};
  if (fstat(descriptor_, &ours) != 0) fail("look at");
  if (ours.st_nlink == 0) refuse_touched(path_, "deleted the journal");
  if (const auto size = static_cast<std::uint64_t>(ours.st_size); size != size_) {
    refuse_touched(path_, fmt::format("{} the journal: it has {} bytes, must have {}",
                                      size < size_ ? "cut" : "written to", size, size_));
  }
}

/// Before each sync: nobody finds what has another name, though it is written well.
void JournalWriter::check_name() const {
  struct stat ours {};
  struct stat named {};
  if (fstat(descriptor_, &ours) != 0) fail("look at");
  const bool is_there = stat(path_.c_str(), &named) == 0;
  if (is_there && named.st_ino == ours.st_ino && named.st_dev == ours.st_dev) return;
  refuse_touched(path_, is_there ? "put another file in the journal's place"
                                 : "moved the journal to another name");
}

void JournalWriter::append(const JournalRecord& record, std::int64_t wall_time_us) {
  buffer_ += frame(record, next_number_++, wall_time_us, last_check_, last_check_);
}

void JournalWriter::flush() {
  if (buffer_.empty()) return;
  check_length();
  std::size_t written = 0;
  while (written < buffer_.size()) {
    const ssize_t size = write(descriptor_, buffer_.data() + written, buffer_.size() - written);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) fail("write");
    written += static_cast<std::size_t>(size);
    size_ += static_cast<std::uint64_t>(size);
    has_unsynced_ = true;
  }
  buffer_.clear();
}

void JournalWriter::sync() {
  if (background_.is_under_way()) end_sync();
  flush();
  if (!has_unsynced_) return;
  begin_sync();
  end_sync();
}

void JournalWriter::begin_sync() {
  flush();
  check_length();
  check_name();
  has_unsynced_ = false;
  background_.begin(descriptor_);
}

void JournalWriter::end_sync() {
  errno = background_.end();
  if (errno != 0) fail("sync");
}

}  // namespace treeroll
