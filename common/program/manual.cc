#include "common/program/manual.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

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

bool is_named(const ManualOption& option) { return option.name.starts_with("--"); }

std::string synopsis(const Manual& manual) {
  std::string text = fmt::format("\\fB{}\\fR [\\fIOPTIONS\\fR]", plain(manual.program));
  for (const ManualOption& option : manual.options) {
    if (!is_named(option)) text += fmt::format(" [\\fI{}\\fR]", plain(option.name));
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
    if (is_named(option) && !option.value.empty()) {
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

std::string bash_completion(const Manual& manual) {
  std::string function = "_" + manual.program;
  std::replace(function.begin(), function.end(), '-', '_');
  std::vector<std::string> names;
  std::string cases;
  std::vector<std::string> valued;
  for (const ManualOption& option : manual.options) {
    if (!is_named(option)) continue;
    names.push_back(option.name);
    if (!option.words.empty()) {
      cases += fmt::format("    {}) COMPREPLY=($(compgen -W \"{}\" -- \"$cur\")); return ;;\n",
                           option.name, fmt::join(option.words, " "));
    } else if (!option.value.empty()) {
      valued.push_back(option.name);
    }
  }
  if (!valued.empty()) {
    cases += fmt::format("    {}) COMPREPLY=($(compgen -f -- \"$cur\")); return ;;\n",
                         fmt::join(valued, "|"));
  }
  return fmt::format(
      "# bash completion of {}\n{}() {{\n"
      "  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD-1]}}\n"
      "  case $prev in\n{}  esac\n"
      "  if [[ $cur == -* ]]; then\n    COMPREPLY=($(compgen -W \"{}\" -- \"$cur\"))\n"
      "  else\n    COMPREPLY=($(compgen -f -- \"$cur\"))\n  fi\n}}\n"
      "complete -o filenames -F {} {}\n",
      manual.program, function, cases, fmt::join(names, " "), function, manual.program);
}

}  // namespace treeroll
