#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

#include "common/settings/settings_reference.h"

namespace treeroll {
namespace {

constexpr std::size_t kColumns = 100;

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

/// Lines of at most 100 columns, all but the first indented. Words are not cut.
std::string wrapped(const std::string& text) {
  std::string lines;
  std::size_t column = 0;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = std::min(text.find(' ', from), text.size());
    const std::size_t length = end - from;
    if (column > 0 && column + 1 + length > kColumns) {
      lines += "\n  ";
      column = 2;
    } else if (column > 0) {
      lines += ' ';
      ++column;
    }
    lines.append(text, from, length);
    column += length;
    from = end + 1;
  }
  return lines;
}

std::string entry(const ListedKey& listed) {
  const KeyNote& note = listed.note;
  std::string text = fmt::format("- `{}`: {}", note.key, note.type);
  if (!note.rule.empty()) text += ", " + note.rule;
  text += note.otherwise.empty() ? "; required" : "; default " + note.otherwise;
  // A table inside of a list is written otherwise in TOML.
  if (!note.example.empty() && note.example.find('{') == std::string::npos) {
    text += fmt::format("; as in `{}`", note.example);
  }
  if (!listed.conditions.empty()) {
    text += fmt::format("; only {}", fmt::join(listed.conditions, ", and "));
  }
  text += ".";
  if (!note.meaning.empty()) text += " " + note.meaning + ".";
  return wrapped(text) + "\n";
}

}  // namespace

std::string reference_part(std::string_view heading, const SettingsReference& reference,
                           std::string_view pattern) {
  const std::string text = reference_text(reference, pattern);
  return text.empty() ? "" : fmt::format("## {}\n\n{}\n", heading, text);
}

std::string reference_text(const SettingsReference& reference, std::string_view pattern) {
  const std::string wanted = lower(pattern);
  std::string text;
  for (const ListedKey& listed : reference.keys) {
    if (lower(listed.note.key + " " + listed.note.meaning).find(wanted) == std::string::npos) {
      continue;
    }
    text += entry(listed);
  }
  return text;
}

}  // namespace treeroll
