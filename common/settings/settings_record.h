#pragma once

#include <compare>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace treeroll {

/// One question of a SettingsReader, in words.
struct KeyNote {
  std::string key;  ///< dotted
  std::string type;
  std::string rule;                ///< bounds; may be empty
  std::string otherwise;           ///< default; empty: the key is required
  std::string meaning;             ///< may be empty
  std::string example;             ///< of a required key; may be empty
  std::vector<std::string> words;  ///< JSON; what a choice or a flag may be
  auto operator<=>(const KeyNote&) const = default;
};

/// What a reader that records has been asked, and what is to be there when it is asked. Keys are
/// dotted. A reader with a record never finds a required key missing: it goes on with an example.
struct SettingsRecord {
  std::set<std::string> present;  ///< these are there, though the table does not hold them

  std::vector<std::string> asked;  ///< keys in the order of the questions, whatever these were
  std::vector<KeyNote> notes;
  std::vector<std::string> answers;  ///< JSON, a note each: what the reader gave
  std::vector<std::string> asked_whether_there;
  std::vector<std::pair<std::string, std::string>> asked_for_word;  ///< key, the word as JSON
  std::vector<std::shared_ptr<const nlohmann::json>> examples;      ///< values made up
};

}  // namespace treeroll
