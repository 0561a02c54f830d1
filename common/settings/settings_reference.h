#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/settings/settings_record.h"

/// The reference of settings: what there is to set, found by asking those who read it.
///
///   const SettingsReference keys = list_settings("exploration", [&](SettingsReader& reader) {
///     read_exploration_settings(reader, policy);
///   });
///   fmt::print("{}", reference_text(keys, ""));
namespace treeroll {

class SettingsReader;

/// A key, or what it is under some conditions.
struct ListedKey {
  KeyNote note;
  /// Under which other keys it is asked for: `exploration.rule = "pi2" or "cem"`. Empty: always.
  std::vector<std::string> conditions;
};

struct SettingsReference {
  std::vector<ListedKey> keys;  ///< tables together, in the order of reading
  std::vector<KeyNote> plain;   ///< those that are asked for where nothing is set
  /// What was tried and refused, with the reason: keys behind that point are not seen there.
  std::vector<std::string> refused;
};

/// Reads a table again and again: with no key, and then with each word of each choice and with each
/// key that the reading depends on. Settings that only another's *number* brings are not found.
/// @param path  of the table
/// @param read  reads it from the start, without finish(); may throw ConfigError
SettingsReference list_settings(const std::string& path,
                                const std::function<void(SettingsReader& reader)>& read);

/// A part of a page of references: its heading, then text; empty if no key of it fits the pattern.
std::string reference_part(std::string_view heading, const SettingsReference& reference,
                           std::string_view pattern);

/// As Markdown that is pleasant on a terminal, an entry a key.
/// @param pattern  part of a key or of its meaning, in any case of letters; empty: all
std::string reference_text(const SettingsReference& reference, std::string_view pattern);

}  // namespace treeroll
