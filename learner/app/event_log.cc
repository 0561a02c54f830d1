#include "learner/app/event_log.h"

#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>

namespace treeroll {
namespace {

constexpr std::uint32_t kEventSyncWord = 0xeda1da01;

template <class Integer>
void put_big_endian(std::string& bytes, Integer value) {
  for (std::size_t i = sizeof value; i-- > 0;) {
    bytes += static_cast<char>(static_cast<std::uint64_t>(value) >> 8 * i);
  }
}

}  // namespace

EventLog::EventLog(const std::filesystem::path& path) {
  if (!path.empty()) file_.emplace(path);
}

void EventLog::append(std::int64_t time_us, std::string_view channel,
                      std::span<const std::byte> message) {
  std::string event;
  put_big_endian(event, kEventSyncWord);
  put_big_endian(event, next_number_++);
  put_big_endian(event, time_us);
  put_big_endian(event, static_cast<std::uint32_t>(channel.size()));
  put_big_endian(event, static_cast<std::uint32_t>(message.size()));
  event += channel;
  event.append(reinterpret_cast<const char*>(message.data()), message.size());
  if (file_) return file_->append(event);
  if (std::fwrite(event.data(), 1, event.size(), stdout) != event.size()) {
    throw std::system_error(errno, std::generic_category(), "cannot write to standard output");
  }
}

void EventLog::commit() {
  if (file_) file_->commit();
}

}  // namespace treeroll
