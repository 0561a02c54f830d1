#include "common/program/manual.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace treeroll {
namespace {

/// Text as roff prints it: no character of it commands.
std::string plain(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\') {
      result += "\\e";
    } else if (c == '-') {
      result += "\\-";
    } else if ((c == '.' || c == '\'') && (result.empty() || result.back() == '\n')) {
      result += std::string("\\&") + c;
    } else {
      result += c;
    }
  }
  return result;
}

std::string synopsis(const Manual& manual) {
  std::string text = fmt::format("\\fB{}\\fR [\\fIOPTIONS\\fR]", plain(manual.program));
  for (const ManualOption& option : manual.options) {
    if (option.is_named()) continue;
    const std::string argument =
        fmt::format("\\fI{}\\fR{}", plain(option.name), option.repeats ? "..." : "");
    text += option.is_required ? " " + argument : " [" + argument + "]";
  }
  return text;
}

}  // namespace

std::string man_page(const Manual& manual) {
  std::string page = fmt::format(
      ".TH {} 1 \"\" \"treeroll {}\" \"treeroll\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n{}\n"
      ".SH OPTIONS\n",
      plain(manual.program), manual.version, plain(manual.program), plain(manual.purpose),
      synopsis(manual));
  for (const ManualOption& option : manual.options) {
    page += fmt::format(".TP\n\\fB{}\\fR", plain(option.name));
    if (option.is_named() && !option.value.empty()) {
      page += fmt::format(" \\fI{}\\fR", plain(option.value));
    }
    page += "\n" + plain(option.text);
    if (!option.words.empty()) {
      page += plain(fmt::format(" (one of: {})", fmt::join(option.words, ", ")));
    }
    if (!option.otherwise.empty()) page += plain(" (default: " + option.otherwise + ")");
    page += "\n";
  }
  if (!manual.examples.empty()) page += ".SH EXAMPLES\n";
  for (const UsageExample& example : manual.examples) {
    page += fmt::format(".TP\n\\fB{}\\fR\n{}\n", plain(example.command), plain(example.what));
  }
  if (!manual.notes.empty()) page += ".SH NOTES\n" + plain(manual.notes) + "\n";
  return page;
}

}  // namespace treeroll
