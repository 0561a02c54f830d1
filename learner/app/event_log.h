#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>

#include "common/files/atomic_file.h"

namespace treeroll {

/// A log as lcm-logger writes one. Appears under its name when it is complete, or not at all.
/// Throws std::runtime_error for what cannot be written: liblcm's own writer reports success on a
/// full disk.
class EventLog {
 public:
  /// @param path  empty: standard output
  explicit EventLog(const std::filesystem::path& path);

  /// @param time_us  since 1970
  void append(std::int64_t time_us, std::string_view channel, std::span<const std::byte> message);
  void commit();

 private:
  std::optional<AtomicFile> file_;
  std::int64_t next_number_ = 0;
};

}  // namespace treeroll
