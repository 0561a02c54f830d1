#include "common/settings/note_conditions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace treeroll {

std::string place_of(const std::string& key) {
  std::string place;
  for (std::size_t i = 0; i < key.size(); ++i) {
    const bool is_digit = key[i] >= '0' && key[i] <= '9';
    if (is_digit && !place.empty() && (place.back() == '_' || place.ends_with("_N"))) {
      if (place.back() == '_') place += 'N';
    } else {
      place += key[i];
    }
  }
  return place;
}

KeyNote placed(KeyNote note) {
  note.key = place_of(note.key);
  return note;
}

void NoteConditions::accept(const SettingsRecord& record,
                            const std::function<bool(const std::string& key)>& is_there) {
  Accepted& accepted = accepted_.emplace_back();
  for (std::size_t i = 0; i < record.notes.size(); ++i) {
    const KeyNote note = placed(record.notes[i]);
    accepted.notes.insert(note);
    accepted.asked.insert(note.key);
    if (!note.words.empty()) accepted.choices[note.key] = {record.answers[i], note.words};
  }
  for (const std::string& key : record.asked_whether_there) {
    accepted.asked.insert(place_of(key));
    accepted.is_there[place_of(key)] |= is_there(key);
  }
  for (const auto& [key, word] : record.asked_for_word) accepted.asked.insert(place_of(key));
}

void NoteConditions::offer(const std::string& key, const std::vector<std::string>& words) {
  std::vector<std::string>& all = words_[key];
  for (const std::string& word : words) {
    if (std::ranges::find(all, word) == all.end()) all.push_back(word);
  }
}

std::vector<std::string> NoteConditions::of(const KeyNote& note) const {
  std::vector<std::string> conditions;
  const auto by_key = found_.find(note);
  if (by_key == found_.end()) return conditions;
  for (const auto& [key, as_found] : by_key->second) {
    if (holds_without(note, key)) continue;
    const Condition condition = widened(note, key, as_found);
    if (!condition.words.empty()) {
      std::vector<std::string> words;
      for (const std::string& word : words_.at(key)) {
        if (condition.words.contains(word)) words.push_back(word);
      }
      conditions.push_back(fmt::format("`{} = {}`", key, fmt::join(words, "` or `")));
    } else if (condition.with || condition.without) {
      conditions.push_back(fmt::format("{} `{}`", condition.with ? "with" : "without", key));
    }
  }
  std::ranges::sort(conditions);
  return conditions;
}

/// A condition was found within one reading. It is none of a note that another one has without
/// having asked for the condition's key: there, the key would be unknown.
bool NoteConditions::holds_without(const KeyNote& note, const std::string& key) const {
  return std::ranges::any_of(accepted_, [&](const Accepted& reading) {
    return reading.notes.contains(note) && !reading.asked.contains(key);
  });
}

/// Not every two alternatives are tried together, so that a condition may be found too narrow: a
/// note that a reading has made where another word stands is made there too.
NoteConditions::Condition NoteConditions::widened(const KeyNote& note, const std::string& key,
                                                  Condition condition) const {
  std::set<std::string> offered;
  for (const Accepted& reading : accepted_) {
    if (!reading.notes.contains(note)) continue;
    const auto choice = reading.choices.find(key);
    if (!condition.words.empty() && choice != reading.choices.end()) {
      condition.words.insert(choice->second.word);
      offered.insert(choice->second.offered.begin(), choice->second.offered.end());
    }
    const auto is_there = reading.is_there.find(key);
    if (is_there == reading.is_there.end()) continue;
    if (is_there->second) condition.without = false;
    if (!is_there->second) condition.with = false;
  }
  // Whatever stands there.
  if (!offered.empty() && std::ranges::includes(condition.words, offered)) condition.words.clear();
  return condition;
}

}  // namespace treeroll
