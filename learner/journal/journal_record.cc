#include "learner/journal/journal_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "common/base/cut_text.h"

namespace treeroll {
namespace {

constexpr std::uint32_t kSyncWord = 0xeda1da01;
constexpr std::size_t kHeaderBytes = 28;
constexpr std::size_t kCheckBytes = 8;
/// Of most records, which are results without a reason.
constexpr std::size_t kResultBytes = 42;
/// Of a start of form 1, behind its kind.
constexpr std::size_t kFirstStartBytes = 28;
constexpr std::string_view kChannel = kJournalChannel;

enum Kind : std::uint8_t {
  kStart = 1,
  kResult = 2,
  kSeal = 3,
  kTime = 4,
  kExtension = 16,
  kWorker = 17,
  kSecond = 18,
  kSignals = 19,
};

template <class Integer>
void put(std::string& bytes, Integer value) {
  std::array<char, sizeof value> big_endian;
  for (std::size_t i = 0; i < sizeof value; ++i) {
    big_endian[i] =
        static_cast<char>(static_cast<std::uint64_t>(value) >> 8 * (sizeof value - 1 - i));
  }
  bytes.append(big_endian.data(), big_endian.size());
}

/// Precondition: at most 255 bytes.
void put_text(std::string& bytes, const std::string& text) {
  put(bytes, static_cast<std::uint8_t>(text.size()));
  bytes += text;
}

/// Reads big-endian integers in turn. Precondition of each: enough bytes are left.
class Cursor {
 public:
  explicit Cursor(std::string_view bytes) : bytes_(bytes) {}

  template <class Integer>
  Integer take() {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i) {
      value = value << 8U | static_cast<std::uint8_t>(bytes_[place_++]);
    }
    return static_cast<Integer>(value);
  }
  std::string_view take_bytes(std::size_t size) {
    place_ += size;
    return bytes_.substr(place_ - size, size);
  }
  /// Nothing if the text would end behind the bytes or is longer than it may be.
  std::optional<std::string> take_text(std::size_t size_max) {
    if (left() < 1) return std::nullopt;
    const auto size = take<std::uint8_t>();
    if (size > size_max || size > left()) return std::nullopt;
    return std::string(take_bytes(size));
  }
  std::size_t left() const { return bytes_.size() - place_; }

 private:
  std::string_view bytes_;
  std::size_t place_ = 0;
};

std::uint64_t check_of(std::string_view bytes) {
  return static_cast<std::uint64_t>(short_form(content_hash(bytes)));
}

void put(std::string& bytes, const ContentHash& hash) {
  bytes.append(reinterpret_cast<const char*>(hash.bytes.data()), hash.bytes.size());
}

void put_result(std::string& bytes, Kind kind, const AcceptedResult& result) {
  put(bytes, static_cast<std::uint8_t>(kind));
  put(bytes, result.key.run);
  put(bytes, result.key.number);
  put(bytes, result.content);
  put(bytes, std::bit_cast<std::uint64_t>(result.outcome.reward()));
  put(bytes, static_cast<std::uint8_t>(result.outcome.status()));
  put(bytes, result.worker_id);
  // A reason stands behind a duration: -1 where nobody measured it.
  if (result.duration_ns || !result.outcome.reason().empty()) {
    put(bytes, result.duration_ns.value_or(-1));
  }
  bytes += result.outcome.reason();
}

std::string payload_of(const JournalRecord& record) {
  std::string bytes;
  bytes.reserve(kResultBytes);
  if (const auto* start = std::get_if<JournalStart>(&record)) {
    put(bytes, static_cast<std::uint8_t>(kStart));
    put(bytes, start->algorithm_version);
    put(bytes, start->study_id);
    put(bytes, start->learner_id);
    if (start->format > 1) {
      put(bytes, start->format);
      put_text(bytes, start->program);
    }
  } else if (const auto* result = std::get_if<AcceptedResult>(&record)) {
    put_result(bytes, kResult, *result);
  } else if (const auto* second = std::get_if<SecondAnswer>(&record)) {
    put_result(bytes, kSecond, second->result);
  } else if (const auto* time = std::get_if<LearningTime>(&record)) {
    put(bytes, static_cast<std::uint8_t>(kTime));
    put(bytes, std::int64_t{time->elapsed.count()});
  } else if (const auto* extension = std::get_if<JournalExtension>(&record)) {
    put(bytes, static_cast<std::uint8_t>(kExtension));
    put(bytes, extension->study_id_before);
    put(bytes, extension->study_id);
    put(bytes, extension->repetitions_before);
    put(bytes, extension->repetitions);
  } else if (const auto* worker = std::get_if<KnownWorker>(&record)) {
    put(bytes, static_cast<std::uint8_t>(kWorker));
    put(bytes, worker->worker_id);
    put(bytes, worker->pid);
    put_text(bytes, cut_text(worker->numeric_class, protocol::kNumericClassBytesMax));
    put_text(bytes, cut_text(worker->host, protocol::kHostNameBytesMax));
  } else if (const auto* signals = std::get_if<TaskSignals>(&record)) {
    put(bytes, static_cast<std::uint8_t>(kSignals));
    put(bytes, signals->task_id);
    put(bytes, static_cast<std::uint16_t>(signals->names.inputs.size()));
    put(bytes, static_cast<std::uint16_t>(signals->names.outputs.size()));
    for (const std::string& name : all_of(signals->names)) put_text(bytes, name);
  } else {
    put(bytes, static_cast<std::uint8_t>(kSeal));
  }
  return bytes;
}

ContentHash take_hash(Cursor& cursor) {
  ContentHash hash;
  std::memcpy(hash.bytes.data(), cursor.take_bytes(hash.bytes.size()).data(), hash.bytes.size());
  return hash;
}

Result<JournalRecord> worker_of(Cursor cursor) {
  KnownWorker worker;
  worker.worker_id = cursor.take<std::int64_t>();
  worker.pid = cursor.take<std::int32_t>();
  const auto numeric_class = cursor.take_text(protocol::kNumericClassBytesMax);
  const auto host = cursor.take_text(protocol::kHostNameBytesMax);
  if (!numeric_class || !host || cursor.left() > 0) return Error{"a worker is not whole"};
  worker.numeric_class = *numeric_class;
  worker.host = *host;
  return JournalRecord(worker);
}

Result<JournalRecord> extension_of(Cursor cursor) {
  JournalExtension extension;
  extension.study_id_before = take_hash(cursor);
  extension.study_id = take_hash(cursor);
  extension.repetitions_before = cursor.take<std::int32_t>();
  extension.repetitions = cursor.take<std::int32_t>();
  if (extension.repetitions_before < 1 || extension.repetitions < extension.repetitions_before) {
    return Error{fmt::format("an extension from {} repetitions to {}", extension.repetitions_before,
                             extension.repetitions)};
  }
  return JournalRecord(extension);
}

/// Of a task that only workers have described: as hostile as what they say.
Result<JournalRecord> signals_of(Cursor cursor) {
  TaskSignals signals;
  signals.task_id = take_hash(cursor);
  const auto num_inputs = cursor.take<std::uint16_t>();
  const auto num_outputs = cursor.take<std::uint16_t>();
  for (int i = 0; i < num_inputs + num_outputs; ++i) {
    std::optional<std::string> name = cursor.take_text(kSignalNameBytesMax);
    if (!name) return Error{"names of signals are not whole"};
    (i < num_inputs ? signals.names.inputs : signals.names.outputs).push_back(*std::move(name));
  }
  if (cursor.left() > 0 || signals.names.empty()) return Error{"names of signals are not whole"};
  if (const auto fault = fault_of(signals.names, num_inputs, num_outputs)) return Error{*fault};
  return JournalRecord(signals);
}

Result<AcceptedResult> result_of(Cursor cursor) {
  AcceptedResult result;
  result.key.run = cursor.take<std::int32_t>();
  result.key.number = cursor.take<std::int32_t>();
  result.content = cursor.take<std::int64_t>();
  const auto reward = std::bit_cast<double>(cursor.take<std::uint64_t>());
  const auto status = cursor.take<std::uint8_t>();
  result.worker_id = cursor.take<std::int64_t>();
  if (cursor.left() > 0) {
    const auto duration_ns = cursor.take<std::int64_t>();
    if (duration_ns >= 0) result.duration_ns = duration_ns;
  }
  if (status >= kNumRolloutStatuses) return Error{fmt::format("status {} is unknown", status)};
  if (!std::isfinite(reward) || reward < 0) {
    return Error{fmt::format("reward {} is not finite or negative", reward)};
  }
  const std::string_view reason = cursor.take_bytes(cursor.left());
  if (!reason.empty() && status == static_cast<std::uint8_t>(RolloutStatus::kOk)) {
    return Error{"a result that is ok has a reason"};
  }
  result.outcome = {reward, static_cast<RolloutStatus>(status), std::string(reason)};
  return result;
}

Result<JournalRecord> record_of(std::string_view payload) {
  Cursor cursor(payload);
  const auto kind = cursor.take<std::uint8_t>();
  if (kind == kStart && cursor.left() >= kFirstStartBytes) {
    JournalStart start;
    start.format = 1;
    start.algorithm_version = cursor.take<std::uint32_t>();
    start.study_id = take_hash(cursor);
    start.learner_id = cursor.take<std::int64_t>();
    if (cursor.left() == 0) return JournalRecord(start);
    if (cursor.left() < sizeof start.format) return Error{"a start ends amid its form"};
    start.format = cursor.take<std::uint32_t>();
    const std::optional<std::string> program = cursor.take_text(kProgramBytesMax);
    // What a later form has beside is its own business: who reads it refuses the form.
    if (!program || start.format < 2 || (start.format <= kJournalFormat && cursor.left() > 0)) {
      return Error{"a start names no form and program"};
    }
    start.program = *program;
    // It goes to terminals, and no version holds anything that one would take for more.
    std::replace_if(
        start.program.begin(), start.program.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return JournalRecord(start);
  }
  const bool has_no_duration = cursor.left() == 33;  // as all in form 1
  if ((kind == kResult || kind == kSecond) && (has_no_duration || cursor.left() >= 41)) {
    const Result<AcceptedResult> result = result_of(cursor);
    if (!result) return result.error();
    return kind == kResult ? JournalRecord(*result) : JournalRecord(SecondAnswer{*result});
  }
  if (kind == kTime && cursor.left() == 8) {
    return JournalRecord(LearningTime{Duration(cursor.take<std::int64_t>())});
  }
  if (kind == kExtension && cursor.left() == 40) return extension_of(cursor);
  if (kind == kWorker && cursor.left() >= 14) return worker_of(cursor);
  if (kind == kSignals && cursor.left() >= 20) return signals_of(cursor);
  if (kind == kSeal && cursor.left() == 0) return JournalRecord(JournalSeal{});
  return Error{fmt::format("a record of kind {} cannot have {} bytes", kind, payload.size())};
}

}  // namespace

std::string frame(const JournalRecord& record, std::int64_t number, std::int64_t wall_time_us,
                  std::uint64_t check_before, std::uint64_t& check) {
  const std::string payload = payload_of(record);
  std::string bytes;
  bytes.reserve(kHeaderBytes + kChannel.size() + payload.size() + 2 * kCheckBytes);
  put(bytes, kSyncWord);
  put(bytes, number);
  put(bytes, wall_time_us);
  put(bytes, static_cast<std::uint32_t>(kChannel.size()));
  put(bytes, static_cast<std::uint32_t>(payload.size() + 2 * kCheckBytes));
  bytes += kChannel;
  bytes += payload;
  put(bytes, check_before);
  check = check_of(bytes);
  put(bytes, check);
  return bytes;
}

std::size_t framed_size(const JournalRecord& record) {
  return kHeaderBytes + kChannel.size() + payload_of(record).size() + 2 * kCheckBytes;
}

Result<FramedRecord> unframe(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes) return Error{"the file ends inside a record's header"};
  Cursor cursor(bytes);
  if (cursor.take<std::uint32_t>() != kSyncWord) return Error{"no record begins here"};
  FramedRecord framed;
  framed.number = cursor.take<std::int64_t>();
  framed.wall_time_us = cursor.take<std::int64_t>();
  const std::size_t channel_size = cursor.take<std::uint32_t>();
  const std::size_t data_size = cursor.take<std::uint32_t>();
  framed.size = kHeaderBytes + channel_size + data_size;
  if (channel_size != kChannel.size() || data_size < 1 + 2 * kCheckBytes ||
      framed.size > kJournalRecordBytesMax) {
    return Error{"the lengths are not those of a record"};
  }
  if (bytes.size() < framed.size) return Error{"the file ends inside a record"};
  if (cursor.take_bytes(channel_size) != kChannel) return Error{"the channel is another one"};
  const std::string_view payload = cursor.take_bytes(data_size - 2 * kCheckBytes);
  framed.check_before = cursor.take<std::uint64_t>();
  framed.check = cursor.take<std::uint64_t>();
  if (framed.check != check_of(bytes.substr(0, framed.size - kCheckBytes))) {
    return Error{"its check does not fit its bytes"};
  }
  Result<JournalRecord> record = record_of(payload);
  if (!record) return record.error();
  framed.record = *record;
  return framed;
}

}  // namespace treeroll
