#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/settings/settings_record.h"

namespace treeroll {

/// The place of a key in the reference: layer_1 and layer_2 are one, layer_N.
std::string place_of(const std::string& key);
/// A note of its place, not of the one key.
KeyNote placed(KeyNote note);

/// Under which other keys a note is made, as readings of a table show it. Notes and keys are
/// placed.
class NoteConditions {
 public:
  /// When a note is made, as far as one other key decides it.
  struct Condition {
    std::set<std::string> words;  ///< JSON; where that key is one of these
    bool with = false;            ///< where it is there
    bool without = false;
  };

  /// What a reading that was not refused has asked for.
  /// @param is_there  whether a key was there
  void accept(const SettingsRecord& record,
              const std::function<bool(const std::string& key)>& is_there);
  /// Words that there may be, in the order in which they are shown.
  void offer(const std::string& key, const std::vector<std::string>& words);
  /// Of a note, by what was found until now: to be added to.
  Condition& found(const KeyNote& note, const std::string& key) { return found_[note][key]; }

  /// What was found, as far as it holds of all readings: `rule = "pi2"` or `"cem"`.
  std::vector<std::string> of(const KeyNote& note) const;

 private:
  struct Choice {
    std::string word;  ///< JSON
    std::vector<std::string> offered;
  };
  struct Accepted {
    std::set<KeyNote> notes;
    std::set<std::string> asked;
    std::map<std::string, Choice> choices;
    std::map<std::string, bool> is_there;  ///< of keys of which that was asked
  };

  bool holds_without(const KeyNote& note, const std::string& key) const;
  Condition widened(const KeyNote& note, const std::string& key, Condition condition) const;

  std::vector<Accepted> accepted_;
  std::map<KeyNote, std::map<std::string, Condition>> found_;  ///< then by key
  std::map<std::string, std::vector<std::string>> words_;
};

}  // namespace treeroll
