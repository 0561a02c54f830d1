#pragma once

#include <string>
#include <vector>

namespace treeroll {

/// An option as a manual shows it.
struct ManualOption {
  std::string name;                ///< "--state-dir", or "STUDY"
  std::string value;               ///< "TEXT"; empty: a flag
  std::vector<std::string> words;  ///< that the value may be; empty: any
  std::string otherwise;           ///< default; may be empty
  std::string text;
  bool repeats = false;      ///< may be given several times
  bool is_required = false;  ///< nothing is done without it

  bool is_named() const { return name.starts_with("--"); }
};

/// One use of a program.
struct UsageExample {
  std::string command;
  std::string what;
};

/// What --help of a program is made of.
struct Manual {
  std::string program;
  std::string version;
  std::string purpose;
  std::vector<ManualOption> options;
  std::vector<UsageExample> examples;
  std::string notes;
};

/// For man(1): section 1, in the macros of man(7).
std::string man_page(const Manual& manual);

}  // namespace treeroll
