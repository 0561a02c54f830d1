#include "common/program/completion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>

namespace treeroll {
namespace {

std::string bash_completion(const Manual& manual) {
  std::string function = "_" + manual.program;
  std::replace(function.begin(), function.end(), '-', '_');
  std::vector<std::string> names;
  std::string cases;
  std::vector<std::string> valued;
  for (const ManualOption& option : manual.options) {
    if (!option.is_named()) continue;
    names.push_back(option.name);
    if (!option.words.empty()) {
      cases += fmt::format(
          "    {}) mapfile -t COMPREPLY < <(compgen -W \"{}\" -- \"$cur\"); return ;;\n",
          option.name, fmt::join(option.words, " "));
    } else if (!option.value.empty()) {
      valued.push_back(option.name);
    }
  }
  if (!valued.empty()) {
    cases += fmt::format("    {}) mapfile -t COMPREPLY < <(compgen -f -- \"$cur\"); return ;;\n",
                         fmt::join(valued, "|"));
  }
  return fmt::format(
      "# bash completion of {}\n{}() {{\n"
      "  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD-1]}}\n"
      // Of "--export=csv" the shell makes three words.
      "  [[ $prev == = ]] && prev=${{COMP_WORDS[COMP_CWORD-2]}}\n  [[ $cur == = ]] && cur=\n"
      "  case $prev in\n{}  esac\n"
      "  if [[ $cur == -* ]]; then\n    mapfile -t COMPREPLY < <(compgen -W \"{}\" -- \"$cur\")\n"
      "  else\n    mapfile -t COMPREPLY < <(compgen -f -- \"$cur\")\n  fi\n}}\n"
      "complete -o filenames -F {} {}\n",
      manual.program, function, cases, fmt::join(names, " "), function, manual.program);
}

/// The text with a backslash before each of these characters.
std::string escaped(const std::string& text, std::string_view characters) {
  std::string result;
  for (const char c : text) {
    if (characters.find(c) != std::string_view::npos) result += '\\';
    result += c;
  }
  return result;
}

bool is_number(const ManualOption& option) { return option.value == "INT"; }

/// A word of zsh, whatever is in it.
std::string zsh_quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

/// As zsh's _arguments reads it: name, text in brackets, and what may stand behind.
std::string zsh_argument(const ManualOption& option) {
  std::string spec = option.repeats ? "*" : "";
  spec += fmt::format("{}[{}]", option.name, escaped(option.text, "[]\\:"));
  if (option.value.empty()) return spec;
  // A value in brackets may be left out.
  spec += option.value.starts_with('[') ? "::" : ":";
  spec += escaped(option.value, ":") + ":";
  if (is_number(option)) return spec + " ";
  return spec +
         (option.words.empty() ? "_files" : fmt::format("({})", fmt::join(option.words, " ")));
}

std::string zsh_completion(const Manual& manual) {
  std::string text = fmt::format("#compdef {}\n# zsh completion of {}\n_arguments", manual.program,
                                 manual.program);
  for (const ManualOption& option : manual.options) {
    if (option.is_named()) text += " \\\n  " + zsh_quoted(zsh_argument(option));
  }
  return text + " \\\n  '*:file:_files'\n";
}

std::string fish_completion(const Manual& manual) {
  std::string text = fmt::format("# fish completion of {}\n", manual.program);
  for (const ManualOption& option : manual.options) {
    if (!option.is_named()) continue;
    text += fmt::format("complete -c {} -l {}", manual.program, option.name.substr(2));
    if (!option.words.empty()) {
      text += fmt::format(" -x -a '{}'", fmt::join(option.words, " "));
    } else if (is_number(option)) {
      text += " -x";
    } else if (!option.value.empty() && !option.value.starts_with('[')) {
      text += " -r";
    }
    text += fmt::format(" -d '{}'\n", escaped(option.text, "'\\"));
  }
  return text;
}

}  // namespace

const std::map<std::string, std::function<std::string(const Manual&)>>& completions() {
  static const std::map<std::string, std::function<std::string(const Manual&)>> by_shell = {
      {"bash", bash_completion}, {"fish", fish_completion}, {"zsh", zsh_completion}};
  return by_shell;
}

}  // namespace treeroll
