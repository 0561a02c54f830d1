#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/program/manual.h"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's name
class App;
class Option;
}  // namespace CLI

namespace treeroll {

/// One option of a command line: the rules its value has to keep. A handle, valid as long as its
/// CommandLine.
class Option {
 public:
  explicit Option(CLI::Option& option) : option_(&option) {}

  Option required() const;
  Option shows_default() const;
  /// For a list: one value each time the option is given, not all that follow it.
  Option one_value_each_time() const;
  /// For a list: exactly so many values.
  Option takes(int num_values) const;
  Option between(std::int64_t min, std::int64_t max) const;
  Option one_of(const std::vector<std::string>& words) const;
  Option needs(const Option& other) const;
  Option excludes(const Option& other) const;
  /// Left out of --help: for programs that start each other.
  Option hidden() const;

  bool given() const;

 private:
  CLI::Option* option_;
};

/// The options of a program. This room alone knows the library that reads them.
class CommandLine {
 public:
  CommandLine(const std::string& program, const std::string& purpose, const std::string& version);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// @param name   "--state-dir", or "STUDY" for an argument known by its place
  /// @param value  set when the line is read; its type says what may stand there: bool (a flag),
  ///               int, std::int64_t, std::string, std::filesystem::path, vectors of the last two,
  ///               std::optional<std::string> (a text that may be left out: empty then)
  /// @param text   for --help
  template <typename Value>
  Option add(const std::string& name, Value& value, const std::string& text);

  /// At least one of these must be given.
  /// @param what  their names in words, for the error: "STUDY or --resume DIR"
  void require_any(const std::string& what, const std::vector<Option>& options);

  /// Stand below the options in --help, examples first.
  void add_examples(const std::vector<UsageExample>& examples);
  void end_help_with(const std::string& text);

  enum class Reading { kComplete, kAnswered, kWrong };

  /// Reads the line into the values. kAnswered: --help, --version or one of two hidden options has
  /// been printed: --help-man (manual.h) and --help-completion SHELL (completion.h), for whoever
  /// packs the program.
  /// kWrong: what is wrong has been printed on standard error.
  Reading read(int argc, char** argv);

 private:
  Manual manual() const;
  /// Whether one of them was asked for, and has been printed.
  bool print_manual(bool as_man_page, const std::string& shell) const;

  struct Choice {
    std::string what;
    std::vector<Option> options;
  };

  std::unique_ptr<CLI::App> app_;
  std::vector<Choice> choices_;
  std::string version_;
  std::vector<UsageExample> examples_;
  std::string notes_;
};

}  // namespace treeroll
