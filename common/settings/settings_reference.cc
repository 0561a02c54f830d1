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
#include "common/settings/note_conditions.h"
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
  int depth = 0;  ///< alternatives on the way from nothing set
};

std::string table_of(const std::string& key) { return key.substr(0, key.rfind('.') + 1); }

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
  struct Alternative {
    std::string word;  ///< JSON; empty: the key is absent
    Reading reading;
  };

  /// What is asked for only where it is there is not required. Whether that is asked comes to light
  /// after the key itself, maybe: two notes become one then.
  void add_entry(const KeyNote& note) {
    ListedKey entry{note, conditions_.of(note)};
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
    if (!result.is_refused) {
      conditions_.accept(result.record, [&](const std::string& key) {
        return result.set.present.contains(key) || result.set.words.contains(key);
      });
    }
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
      if (!is_new(base, note.key, fmt::format("{}", fmt::join(note.words, "|")))) continue;
      std::vector<Alternative> all;
      all.push_back({base.record.answers[i], base});
      add_words(base, note, all);
      compare(note.key, std::move(all));
    }
    for (const std::string& key : base.record.asked_whether_there) {
      if (base.set.words.contains(key) || base.set.present.contains(key)) continue;
      if (!is_new(base, key, "there")) continue;
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
        is_new(base, key, fmt::format("{}", fmt::join(note->words, "|")));
        add_words(base, *note, all);
      }
      compare(key, std::move(all));
    }
    for (const auto& [key, word] : base.record.asked_for_word) {
      conditions_.offer(place_of(key), {word});
      if (base.set.words.contains(key) || !is_new(base, key, word)) continue;
      Assignment set = base.set;
      set.words[key] = word;
      std::vector<Alternative> all;
      all.push_back({"", base});
      all.push_back({word, beside(base, std::move(set), key)});
      compare(key, std::move(all));
    }
  }

  /// A question is tried once, and once more beside each word of a choice that brings other keys
  /// of the same table and comes before it: what hangs on the answer may be another there.
  bool is_new(const Reading& base, const std::string& key, const std::string& question) {
    const std::string asked = place_of(key) + " " + question;
    bool is_new = tried_.insert(asked).second;
    for (const auto& [of_key, word] : context_of(base, key)) {
      is_new = tried_.insert(fmt::format("{} {} {}", asked, of_key, word)).second;
    }
    return is_new;
  }

  /// The word beside which a question is tried again; more than one where one brought the other.
  std::map<std::string, std::string> context_of(const Reading& base, const std::string& key) const {
    if (base.depth != 1) return {};
    const auto place_in_reading = [&](const std::string& of) {
      return std::ranges::find(base.record.asked, of) - base.record.asked.begin();
    };
    std::map<std::string, std::string> words = base.set.words;
    std::erase_if(words, [&](const auto& set) {
      return !brings_keys_.contains(set.first) || table_of(set.first) != table_of(key) ||
             place_in_reading(key) < place_in_reading(set.first);
    });
    return words;
  }

  /// Whether alternatives of a key ask for different keys of its table.
  static bool brings_keys(const std::string& key, const std::vector<Alternative>& all) {
    const auto keys_of = [&](const Alternative& alternative) {
      std::set<std::string> keys;
      for (const KeyNote& note : alternative.reading.record.notes) {
        if (table_of(note.key) == table_of(key)) keys.insert(note.key);
      }
      keys.erase(key);
      return keys;
    };
    return std::ranges::any_of(all, [&](const Alternative& alternative) {
      return !alternative.reading.is_refused && keys_of(alternative) != keys_of(all.front());
    });
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
    if (brings_keys(key, all)) brings_keys_.insert(key);
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
      if (always) continue;
      for (const auto& [of_key, word] : context_of(all.front().reading, key)) {
        conditions_.found(note, of_key).words.insert(word);
      }
      NoteConditions::Condition& condition = conditions_.found(note, place_of(key));
      // Every word there is, and not its absence.
      if (words.size() > 1 && words.size() + 1 == all.size() && all.front().word.empty()) {
        words = {"there"};
      }
      if (words.empty()) {
        condition.without = true;
      } else if (words.front() == "there") {
        condition.with = true;
      } else {
        condition.words.insert(words.begin(), words.end());
      }
    }
    const int depth = all.front().reading.depth + 1;
    for (std::size_t a = 0; a < all.size(); ++a) {
      for (const KeyNote& note : all[a].reading.record.notes) keep(note);
      if (a == 0) continue;
      all[a].reading.depth = depth;
      waiting_.push_back(std::move(all[a].reading));
    }
  }

  void keep(const KeyNote& note) {
    const KeyNote kept = placed(note);
    conditions_.offer(kept.key, note.words);
    ranks_.try_emplace(kept.key, ranks_.size());
    if (kept_.insert(kept).second) order_.push_back(kept);
  }

  /// Of a key: first that of its table's first key, then its own.
  std::pair<std::size_t, std::size_t> rank(const std::string& key) const {
    std::size_t first = ranks_.at(key);
    for (const auto& [other, number] : ranks_) {
      if (table_of(other) == table_of(key)) first = std::min(first, number);
    }
    return {first, ranks_.at(key)};
  }

  std::string path_;
  const std::function<void(SettingsReader&)>& read_;
  std::deque<Reading> waiting_;
  std::set<std::string> tried_;
  std::set<std::string> brings_keys_;  ///< choices whose words do, as far as is known
  std::set<std::string> optional_;     ///< places
  std::map<std::string, std::size_t> ranks_;
  std::set<KeyNote> kept_;
  std::vector<KeyNote> order_;
  NoteConditions conditions_;
  SettingsReference reference_;
};

}  // namespace

SettingsReference list_settings(const std::string& path,
                                const std::function<void(SettingsReader& reader)>& read) {
  return Lister(path, read).take();
}

}  // namespace treeroll
