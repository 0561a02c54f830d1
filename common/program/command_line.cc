#include "common/program/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <type_traits>

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
    : app_(std::make_unique<CLI::App>(purpose, program)) {
  app_->set_version_flag("--version", program + " " + version);
}

CommandLine::~CommandLine() = default;

template <typename Value>
Option CommandLine::add(const std::string& name, Value& value, const std::string& text) {
  if constexpr (std::is_same_v<Value, bool>) {
    return Option(*app_->add_flag(name, value, text));
  } else {
    return Option(*app_->add_option(name, value, text));
  }
}

template Option CommandLine::add(const std::string&, bool&, const std::string&);
template Option CommandLine::add(const std::string&, int&, const std::string&);
template Option CommandLine::add(const std::string&, std::int64_t&, const std::string&);
template Option CommandLine::add(const std::string&, std::string&, const std::string&);
template Option CommandLine::add(const std::string&, std::filesystem::path&, const std::string&);
template Option CommandLine::add(const std::string&, std::vector<std::string>&, const std::string&);
template Option CommandLine::add(const std::string&, std::vector<std::filesystem::path>&,
                                 const std::string&);

void CommandLine::require_any(const std::string& what, const std::vector<Option>& options) {
  choices_.push_back({what, options});
}

void CommandLine::end_help_with(const std::string& text) { app_->footer(text); }

CommandLine::Reading CommandLine::read(int argc, char** argv) {
  try {
    app_->parse(argc, argv);
    for (const Choice& choice : choices_) {
      const bool any = std::any_of(choice.options.begin(), choice.options.end(),
                                   [](const Option& option) { return option.given(); });
      if (!any) throw CLI::RequiredError(choice.what);
    }
  } catch (const CLI::ParseError& error) {
    return app_->exit(error) == 0 ? Reading::kAnswered : Reading::kWrong;
  }
  return Reading::kComplete;
}

}  // namespace treeroll
