#include "common/settings/settings_reference.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "common/base/config_error.h"
#include "common/settings/settings_reader.h"

namespace treeroll {
namespace {

using nlohmann::json;

/// What is set for one reading.
struct Assignment {
  std::map<std::string, std::string> words;  ///< JSON by key
  std::set<std::string> present;
};

/// One reading of a table.
struct Reading {
  Assignment set;
  SettingsRecord record;
  bool is_refused = false;
};

/// layer_1 and layer_2 are one place: layer_N.
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

/// A note as the reference has it: of the place, not of the one key.
KeyNote placed(KeyNote note) {
  note.key = place_of(note.key);
  return note;
}

class Lister {
 public:
  Lister(std::string path, const std::function<void(SettingsReader&)>& read)
      : path_(std::move(path)), read_(read) {
    waiting_.push_back(reading({}));
    reference_.plain = waiting_.front().record.notes;
    while (!waiting_.empty()) {
      const Reading base = std::move(waiting_.front());
      waiting_.pop_front();
      for (const KeyNote& note : base.record.notes) keep(note);
      branch(base);
    }
  }

  SettingsReference take() {
    std::stable_sort(order_.begin(), order_.end(),
                     [&](const KeyNote& a, const KeyNote& b) { return rank(a.key) < rank(b.key); });
    for (const KeyNote& note : order_) add_entry(note);
    return std::move(reference_);
  }

 private:
  struct Accepted {
    std::set<KeyNote> notes;      ///< placed
    std::set<std::string> asked;  ///< places
  };

  struct Alternative {
    std::string word;  ///< JSON; empty: the key is absent
    Reading reading;
  };

  /// What is asked for only where it is there is not required. Whether that is asked comes to light
  /// after the key itself, maybe: two notes become one then.
  void add_entry(const KeyNote& note) {
    ListedKey entry{note, {}};
    for (const auto& [of_key, words] : conditions_[note]) {
      if (holds_without(note, of_key)) continue;
      entry.conditions.insert(entry.conditions.end(), words.begin(), words.end());
    }
    std::ranges::sort(entry.conditions);
    if (note.otherwise.empty() && optional_.contains(note.key)) entry.note.otherwise = "none";
    for (ListedKey& known : reference_.keys) {
      if (known.note != entry.note) continue;
      for (const std::string& condition : entry.conditions) {
        if (std::ranges::find(known.conditions, condition) == known.conditions.end()) {
          known.conditions.push_back(condition);
        }
      }
      return;
    }
    reference_.keys.push_back(std::move(entry));
  }

  /// A condition was found within one reading. It is none of a note that another one has without
  /// having asked for the condition's key: there, the key would be unknown.
  bool holds_without(const KeyNote& note, const std::string& key) const {
    return std::ranges::any_of(accepted_, [&](const Accepted& reading) {
      return reading.notes.contains(note) && !reading.asked.contains(key);
    });
  }

  /// What a reading that was not refused has asked for.
  void accept(const SettingsRecord& record) {
    Accepted& accepted = accepted_.emplace_back();
    for (const KeyNote& note : record.notes) {
      accepted.notes.insert(placed(note));
      accepted.asked.insert(place_of(note.key));
    }
    for (const std::string& key : record.asked_whether_there) accepted.asked.insert(place_of(key));
    for (const auto& [key, word] : record.asked_for_word) accepted.asked.insert(place_of(key));
  }

  Reading reading(Assignment set) {
    Reading result{.set = std::move(set), .record = {}};
    json table = json::object();
    for (const auto& [key, word] : result.set.words) {
      std::string pointer = path_.empty() ? "/" + key : key.substr(path_.size());
      std::replace(pointer.begin(), pointer.end(), '.', '/');
      table[json::json_pointer(pointer)] = json::parse(word);
    }
    result.record.present = result.set.present;
    json resolved;
    SettingsReader reader(table, path_, resolved, &result.record);
    std::string reason;
    try {
      read_(reader);
    } catch (const ConfigError& error) {
      reason = error.what();
    } catch (const std::invalid_argument& error) {
      reason = error.what();
    }
    result.is_refused = !reason.empty();
    if (result.is_refused) {
      std::vector<std::string> tried;
      for (const auto& [key, word] : result.set.words) tried.push_back(key + " = " + word);
      for (const std::string& key : result.set.present) tried.push_back(key);
      reference_.refused.push_back(fmt::format("{}: {}", fmt::join(tried, ", "), reason));
    }
    if (!result.is_refused) accept(result.record);
    const auto& asked = result.record.asked_whether_there;
    for (const std::string& key : asked) optional_.insert(place_of(key));
    return result;
  }

  /// What a choice without a value came to is told in `base`: an alternative whose default differs
  /// is read with the same, so that only the one key makes the difference.
  Reading beside(const Reading& base, Assignment set, const std::string& key) {
    Reading result = reading(set);
    bool differs = false;
    for (std::size_t i = 0; i < result.record.notes.size(); ++i) {
      const KeyNote& note = result.record.notes[i];
      if (note.words.empty() || note.key == key || set.words.contains(note.key)) continue;
      for (std::size_t j = 0; j < base.record.notes.size(); ++j) {
        if (base.record.notes[j].key != note.key) continue;
        const std::string& answer = base.record.answers[j];
        if (answer == result.record.answers[i]) continue;
        if (std::find(note.words.begin(), note.words.end(), answer) == note.words.end()) continue;
        set.words[note.key] = answer;
        differs = true;
      }
    }
    return differs ? reading(std::move(set)) : result;
  }

  void branch(const Reading& base) {
    for (std::size_t i = 0; i < base.record.notes.size(); ++i) {
      const KeyNote& note = base.record.notes[i];
      if (note.words.empty() || base.set.words.contains(note.key)) continue;
      if (!is_new(note.key, fmt::format("{}", fmt::join(note.words, "|")))) continue;
      std::vector<Alternative> all;
      all.push_back({base.record.answers[i], base});
      add_words(base, note, all);
      compare(note.key, std::move(all));
    }
    for (const std::string& key : base.record.asked_whether_there) {
      if (base.set.words.contains(key) || base.set.present.contains(key)) continue;
      if (!is_new(key, "there")) continue;
      Assignment set = base.set;
      set.present.insert(key);
      std::vector<Alternative> all;
      all.push_back({"", base});
      Reading there = beside(base, std::move(set), key);
      const auto note = std::find_if(there.record.notes.begin(), there.record.notes.end(),
                                     [&](const KeyNote& n) { return n.key == key; });
      if (note == there.record.notes.end() || note->words.empty()) {
        all.push_back({"there", std::move(there)});
      } else {
        is_new(key, fmt::format("{}", fmt::join(note->words, "|")));
        add_words(base, *note, all);
      }
      compare(key, std::move(all));
    }
    for (const auto& [key, word] : base.record.asked_for_word) {
      if (base.set.words.contains(key) || !is_new(key, word)) continue;
      Assignment set = base.set;
      set.words[key] = word;
      std::vector<Alternative> all;
      all.push_back({"", base});
      all.push_back({word, beside(base, std::move(set), key)});
      compare(key, std::move(all));
    }
  }

  bool is_new(const std::string& key, const std::string& question) {
    return tried_.insert(place_of(key) + " " + question).second;
  }

  /// A reading with each word that `all` does not have yet.
  void add_words(const Reading& base, const KeyNote& note, std::vector<Alternative>& all) {
    for (const std::string& word : note.words) {
      if (word == all.front().word) continue;
      Assignment set = base.set;
      set.present.erase(note.key);
      set.words[note.key] = word;
      all.push_back({word, beside(base, std::move(set), note.key)});
    }
  }

  /// Which keys are asked for by some alternatives only.
  void compare(const std::string& key, std::vector<Alternative> all) {
    std::map<KeyNote, std::set<std::size_t>> seen;
    for (std::size_t a = 0; a < all.size(); ++a) {
      for (const KeyNote& note : all[a].reading.record.notes) {
        seen[placed(note)].insert(a);
      }
    }
    for (const auto& [note, where] : seen) {
      if (note.key == place_of(key)) continue;
      bool always = true;
      std::vector<std::string> words;
      for (std::size_t a = 0; a < all.size(); ++a) {
        // What a refused reading has not come to says nothing.
        if (!where.contains(a) && !all[a].reading.is_refused) always = false;
        // Where a word stands for what an absent key means, the word says it.
        if (where.contains(a) && !all[a].word.empty()) words.push_back(all[a].word);
      }
      // Every word there is, and not its absence.
      if (words.size() > 1 && words.size() + 1 == all.size() && all.front().word.empty()) {
        words = {"there"};
      }
      if (!always) conditions_[note][place_of(key)].insert(condition(place_of(key), words));
    }
    for (std::size_t a = 0; a < all.size(); ++a) {
      for (const KeyNote& note : all[a].reading.record.notes) keep(note);
      if (a > 0) waiting_.push_back(std::move(all[a].reading));
    }
  }

  static std::string condition(const std::string& key, const std::vector<std::string>& words) {
    if (words.empty()) return fmt::format("without `{}`", key);
    if (words.front() == "there") return fmt::format("with `{}`", key);
    return fmt::format("`{} = {}`", key, fmt::join(words, "` or `"));
  }

  void keep(const KeyNote& note) {
    const KeyNote kept = placed(note);
    ranks_.try_emplace(kept.key, ranks_.size());
    if (kept_.insert(kept).second) order_.push_back(kept);
  }

  /// Of a key: first that of its table's first key, then its own.
  std::pair<std::size_t, std::size_t> rank(const std::string& key) const {
    const std::string table = key.substr(0, key.rfind('.') + 1);
    std::size_t first = ranks_.at(key);
    for (const auto& [other, number] : ranks_) {
      if (other.substr(0, other.rfind('.') + 1) == table) first = std::min(first, number);
    }
    return {first, ranks_.at(key)};
  }

  std::string path_;
  const std::function<void(SettingsReader&)>& read_;
  std::deque<Reading> waiting_;
  std::set<std::string> tried_;
  std::set<std::string> optional_;  ///< places
  std::map<std::string, std::size_t> ranks_;
  std::set<KeyNote> kept_;
  std::vector<KeyNote> order_;
  std::vector<Accepted> accepted_;
  std::map<KeyNote, std::map<std::string, std::set<std::string>>> conditions_;  ///< by their key
  SettingsReference reference_;
};

}  // namespace

SettingsReference list_settings(const std::string& path,
                                const std::function<void(SettingsReader& reader)>& read) {
  return Lister(path, read).take();
}

}  // namespace treeroll
