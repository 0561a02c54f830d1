#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/settings/key_help.h"

namespace treeroll {

struct KeyNote;
struct SettingsRecord;

/// Bounds of a number; the defaults allow any finite one.
struct NumberRule {
  double min = -std::numeric_limits<double>::max();
  double max = std::numeric_limits<double>::max();
  bool min_allowed = true;  ///< false: must be greater than min
};
inline constexpr NumberRule kAnyNumber{};
inline constexpr NumberRule kPositive{.min = 0, .min_allowed = false};
inline constexpr NumberRule kNotNegative{.min = 0};

/// Reads one table of settings strictly: every key is asked for by name, type and rule, and
/// `finish()` refuses those nobody asked for. All errors are ConfigErrors with the dotted key.
///
///   SettingsReader task(settings, "task", resolved);
///   const double step_s = task.number("step_s", kPositive, 1e-3);
///   task.finish();
///
/// A key without a fallback is required. What was read, defaults included, is written to
/// `resolved`, so that a study can be repeated after a default has changed.
class SettingsReader {
 public:
  /// @param table     a JSON object; must outlive the reader, like `resolved`
  /// @param path      dotted path of the table, prefix of its keys in errors
  /// @param resolved  set to an object that receives every value read
  /// @param record    null, or what notes every question (settings_record.h); must outlive it
  SettingsReader(const nlohmann::json& table, std::string path, nlohmann::json& resolved,
                 SettingsRecord* record = nullptr);

  double number(std::string_view key, NumberRule rule, std::optional<double> fallback = {},
                const KeyHelp& help = {});
  /// One that may be left out, where no number could stand for that.
  std::optional<double> optional_number(std::string_view key, NumberRule rule,
                                        const KeyHelp& help = {});
  std::int64_t integer(std::string_view key, std::int64_t min, std::int64_t max,
                       std::optional<std::int64_t> fallback = {}, const KeyHelp& help = {});
  bool boolean(std::string_view key, std::optional<bool> fallback = {}, const KeyHelp& help = {});
  std::string string(std::string_view key, std::optional<std::string> fallback = {},
                     const KeyHelp& help = {});
  /// Whether the key holds this very word, in place of a value of another type; if so, it is read.
  bool is_word(std::string_view key, std::string_view word, const KeyHelp& help = {});
  /// One of a few words.
  std::string choice(std::string_view key, const std::vector<std::string_view>& words,
                     std::optional<std::string> fallback = {}, const KeyHelp& help = {});
  /// A list of numbers, each within `rule`, between min_size and max_size long.
  std::vector<double> numbers(std::string_view key, NumberRule rule, std::size_t min_size,
                              std::size_t max_size,
                              std::optional<std::vector<double>> fallback = {},
                              const KeyHelp& help = {});
  /// A list of rows of numbers, all equally long: [[1, 2], [3, 4]]. A list of plain numbers stands
  /// for rows of one number where rows may be that short, and else for a single row.
  std::vector<std::vector<double>> rows(
      std::string_view key, NumberRule rule, std::size_t rows_max, std::size_t size_min,
      std::size_t size_max, std::optional<std::vector<std::vector<double>>> fallback = {},
      const KeyHelp& help = {});
  /// A list of strings, between 1 and size_max long.
  std::vector<std::string> strings(std::string_view key, std::size_t size_max,
                                   const KeyHelp& help = {});
  /// A list of anything, not empty.
  const nlohmann::json& list(std::string_view key, std::size_t size_max, const KeyHelp& help = {});
  /// A table below this one; absent counts as empty.
  SettingsReader table(std::string_view key);

  bool has(std::string_view key) const;
  /// Throws on the first key that was not asked for.
  void finish() const;
  /// For a rule of the caller's own about `key`: never returns.
  [[noreturn]] void refuse(std::string_view key, const std::string& rule) const;

 private:
  const nlohmann::json* find(std::string_view key);
  /// The value of a key, or null: then its fallback counts. A reader that records notes it.
  const nlohmann::json* value_of(std::string_view key, bool has_fallback, const KeyHelp& help,
                                 const std::function<KeyNote()>& note);
  std::string text_of(std::string_view key, const nlohmann::json* value,
                      const std::optional<std::string>& fallback);
  std::string full(std::string_view key) const;

  const nlohmann::json* table_;
  std::string path_;
  nlohmann::json* resolved_;
  SettingsRecord* record_;
  std::set<std::string, std::less<>> asked_;
};

}  // namespace treeroll
