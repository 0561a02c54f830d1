#include "common/program/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <optional>
#include <sstream>
#include <type_traits>

#include "common/program/completion.h"

namespace treeroll {

Option Option::required() const {
  option_->required();
  return *this;
}

Option Option::shows_default() const {
  option_->capture_default_str();
  return *this;
}

Option Option::one_value_each_time() const {
  option_->type_size(1)->allow_extra_args(false);
  return *this;
}

Option Option::takes(int num_values) const {
  option_->expected(num_values);
  return *this;
}

Option Option::between(std::int64_t min, std::int64_t max) const {
  option_->check(CLI::Range(min, max));
  return *this;
}

Option Option::one_of(const std::vector<std::string>& words) const {
  option_->check(CLI::IsMember(words));
  return *this;
}

Option Option::needs(const Option& other) const {
  option_->needs(other.option_);
  return *this;
}

Option Option::excludes(const Option& other) const {
  option_->excludes(other.option_);
  return *this;
}

Option Option::hidden() const {
  option_->group("");
  return *this;
}

bool Option::given() const { return !option_->empty(); }

CommandLine::CommandLine(const std::string& program, const std::string& purpose,
                         const std::string& version)
    : app_(std::make_unique<CLI::App>(purpose, program)), version_(version) {
  app_->set_version_flag("--version", program + " " + version);
}

CommandLine::~CommandLine() = default;

template <typename Value>
Option CommandLine::add(const std::string& name, Value& value, const std::string& text) {
  if constexpr (std::is_same_v<Value, bool>) {
    return Option(*app_->add_flag(name, value, text));
  } else if constexpr (std::is_same_v<Value, std::optional<std::string>>) {
    const auto take = [&value](const CLI::results_t& given) {
      // The library's word for no value.
      value = given.empty() || given.front() == "{}" ? "" : given.front();
      return true;
    };
    return Option(*app_->add_option(name, take, text)->type_name("[TEXT]")->expected(0, 1));
  } else {
    return Option(*app_->add_option(name, value, text));
  }
}

template Option CommandLine::add(const std::string&, bool&, const std::string&);
template Option CommandLine::add(const std::string&, int&, const std::string&);
template Option CommandLine::add(const std::string&, std::int64_t&, const std::string&);
template Option CommandLine::add(const std::string&, std::string&, const std::string&);
template Option CommandLine::add(const std::string&, std::optional<std::string>&,
                                 const std::string&);
template Option CommandLine::add(const std::string&, std::filesystem::path&, const std::string&);
template Option CommandLine::add(const std::string&, std::vector<std::string>&, const std::string&);
template Option CommandLine::add(const std::string&, std::vector<std::filesystem::path>&,
                                 const std::string&);

void CommandLine::require_any(const std::string& what, const std::vector<Option>& options) {
  choices_.push_back({what, options});
}

void CommandLine::add_examples(const std::vector<UsageExample>& examples) {
  examples_.insert(examples_.end(), examples.begin(), examples.end());
}

void CommandLine::end_help_with(const std::string& text) { notes_ = text; }

Manual CommandLine::manual() const {
  Manual manual{.program = app_->get_name(),
                .version = version_.substr(0, version_.find(' ')),
                .purpose = app_->get_description(),
                .options = {},
                .examples = examples_,
                .notes = notes_};
  for (const CLI::Option* option : app_->get_options()) {
    if (option->get_group().empty()) continue;
    ManualOption shown{.name = option->get_name(),
                       .value = {},
                       .words = {},
                       .otherwise = option->get_default_str(),
                       .text = option->get_description(),
                       .repeats = option->get_items_expected_max() > 1,
                       .is_required = option->get_required()};
    // "-h,--help": the long one.
    shown.name = shown.name.substr(shown.name.rfind(',') + 1);
    if (option->get_items_expected_max() > 0) {
      // The library writes rules behind the type: "TEXT:{text,json}", "INT:INT in [0 - 1024]".
      const std::string type = option->get_type_name();
      shown.value = type.substr(0, type.find(':'));
      if (const auto open = type.find(":{"); open != std::string::npos && type.back() == '}') {
        std::istringstream words(type.substr(open + 2, type.size() - open - 3));
        for (std::string word; std::getline(words, word, ',');) shown.words.push_back(word);
      }
    }
    manual.options.push_back(std::move(shown));
  }
  return manual;
}

bool CommandLine::print_manual(bool as_man_page, const std::string& shell) const {
  const auto completion = completions().find(shell);
  if (as_man_page) {
    fmt::print("{}", man_page(manual()));
  } else if (completion != completions().end()) {
    fmt::print("{}", completion->second(manual()));
  } else {
    return false;
  }
  return true;
}

CommandLine::Reading CommandLine::read(int argc, char** argv) {
  bool man = false;
  std::string shell;
  std::vector<std::string> shells;
  for (const auto& [name, completion] : completions()) shells.push_back(name);
  app_->add_flag("--help-man", man, "")->group("");
  app_->add_option("--help-completion", shell, "")->group("")->check(CLI::IsMember(shells));
  std::string below;
  for (const UsageExample& example : examples_) {
    below += fmt::format("{}  {}\n      {}\n", below.empty() ? "Examples:\n" : "", example.command,
                         example.what);
  }
  app_->footer(below + (below.empty() || notes_.empty() ? "" : "\n") + notes_);
  try {
    app_->parse(argc, argv);
    for (const Choice& choice : choices_) {
      const bool any = std::any_of(choice.options.begin(), choice.options.end(),
                                   [](const Option& option) { return option.given(); });
      if (!any) throw CLI::RequiredError(choice.what);
    }
  } catch (const CLI::ParseError& error) {
    // Asked for beside nothing else: what the program requires is not needed for it.
    if (print_manual(man, shell)) return Reading::kAnswered;
    return app_->exit(error) == 0 ? Reading::kAnswered : Reading::kWrong;
  }
  return print_manual(man, shell) ? Reading::kAnswered : Reading::kComplete;
}

}  // namespace treeroll
