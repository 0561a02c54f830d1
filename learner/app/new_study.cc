#include "learner/app/new_study.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "common/base/config_error.h"
#include "common/program/standard_output.h"
#include "common/task_facts/task_agreement.h"
#include "learner/study/new_study_text.h"
#include "learner/study/setting_overlay.h"
#include "learner/study/toml_source.h"
#include "learner/worker_program/process.h"
#include "learner/worker_program/program_answer.h"
#include "learner/worker_program/task_survey.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// What the worker executable says of a task: {"settings": [..], "start": TOML}.
json example_of(const std::string& task, const WorkerProgram& worker_program) {
  // A program of the user's own has no list of its settings: their defaults are in its description.
  if (!worker_program.evaluator.empty()) return {{"settings", json::array()}, {"start", ""}};
  const Result<ProgramOutput> answer =
      run_program(worker_program.path, {"--task-example", task}, "", kDescriptionLimit);
  if (!answer) throw std::runtime_error("cannot ask about the task: " + answer.error().message);
  return read_program_answer(answer->output, "task.name",
                             fmt::format("{} --task-example ended with status {} and said nothing "
                                         "that can be read",
                                         worker_program.path.string(), answer->exit_status));
}

/// A table is as many settings with dotted keys: JSON is no TOML there.
void add_flat(const std::string& argument, const std::string& key, const json& value,
              std::map<std::string, json>& flat) {
  if (value.is_object()) {
    for (const auto& [below, inner] : value.items()) {
      if (below.empty() || below.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRS"
                                                   "TUVWXYZ0123456789_-") != std::string::npos) {
        throw ConfigError("--set", argument, "must have keys of letters, digits, _ and -");
      }
      add_flat(argument, fmt::format("{}.{}", key, below), inner, flat);
    }
    return;
  }
  if (value.is_array() && std::ranges::any_of(value.flatten(), [](const json& element) {
        return element.is_object();
      })) {
    throw ConfigError("--set", argument, "must hold no tables within a list with --new");
  }
  flat[key] = value;
}

/// The values of --set task.KEY=VALUE by KEY.
std::map<std::string, json> given_settings(const std::vector<std::string>& overrides) {
  std::map<std::string, json> given;
  for (const std::string& argument : overrides) {
    const SettingOverride setting = parse_override(argument);
    if (setting.key.size() < 2 || setting.key.front() != "task") {
      throw ConfigError("--set", argument,
                        "must be a setting of the task: with --new, the rest is "
                        "for you to write into the file");
    }
    const std::vector<std::string> below(setting.key.begin() + 1, setting.key.end());
    json value;
    parse_override_value(setting, value);
    add_flat(argument, fmt::format("{}", fmt::join(below, ".")), value, given);
  }
  return given;
}

std::vector<NewTaskSetting> settings_of(const json& example, std::map<std::string, json> given) {
  std::vector<NewTaskSetting> settings;
  for (const json& setting : example.at("settings")) {
    NewTaskSetting shown{.key = setting.at("key"),
                         .value = setting.at("value"),
                         .is_set = setting.at("required"),
                         .meaning = setting.at("meaning")};
    if (const auto own = given.find(shown.key); own != given.end()) {
      shown.value = own->second.dump();
      shown.is_set = true;
      given.erase(own);
    }
    if (shown.is_set && shown.value.empty()) {
      throw ConfigError(
          "task." + shown.key, "",
          fmt::format("is required and has no example: give it, --set task.{}=VALUE", shown.key));
    }
    // What is below a table, or absent by default, is found by --help-keys: this is to be short.
    if (shown.is_set || (shown.key.find('.') == std::string::npos && json::accept(shown.value))) {
      settings.push_back(std::move(shown));
    }
  }
  for (auto& [key, value] : given) settings.push_back({key, value.dump(), true, ""});
  return settings;
}

/// What a task of one input calls how long it takes, if it does.
double input_max(const json& settings) {
  for (const char* key : {"duration_s", "duration"}) {
    if (settings.contains(key) && settings[key].is_number()) return settings[key].get<double>();
  }
  return 1;
}

/// A word for a shell, on one line.
std::string shell_word(std::string word) {
  std::ranges::replace_if(
      word, [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  for (std::size_t at = 0; (at = word.find('\'', at)) != std::string::npos; at += 4) {
    word.replace(at, 1, "'\\''");
  }
  return "'" + word + "'";
}

/// The options without which the next step would not know the task.
std::string options_of(const WorkerProgram& program) {
  if (!program.evaluator.empty()) return " --evaluator " + shell_word(program.evaluator);
  if (program.path == program_beside_us("treeroll-worker")) return "";
  return " --worker-program " + shell_word(program.path.string());
}

/// A study's name from that of its file.
std::string study_name(const fs::path& file) {
  std::string name = file.stem().string();
  std::replace_if(
      name.begin(), name.end(),
      [](unsigned char c) { return std::isalnum(c) == 0 && c != '_' && c != '-' && c != '.'; },
      '_');
  if (name.empty() || name.front() == '.' || name.front() == '-') name = "study" + name;
  return name.substr(0, 64);
}

void write_new(const fs::path& file, const std::string& text) {
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0 && errno == EEXIST) {
    throw ConfigError("--new", file.string(), "exists, and is left as it is: name another file");
  }
  const auto fail = [&] {
    throw std::runtime_error(
        fmt::format("cannot write {}: {}", file.string(), std::strerror(errno)));
  };
  if (descriptor < 0) fail();
  const bool is_written =
      write(descriptor, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (close(descriptor) != 0 || !is_written) {
    const int error = errno;
    unlink(file.c_str());
    errno = error;
    fail();
  }
}

}  // namespace

void write_new_study(const LearnerOptions& options) {
  if (fs::exists(fs::symlink_status(options.new_file))) {
    throw ConfigError("--new", options.new_file.string(),
                      "exists, and is left as it is: name another file");
  }
  const json example = example_of(options.new_task, options.worker_program);
  NewStudy study{.name = study_name(options.new_file),
                 .task = options.new_task,
                 .options = options_of(options.worker_program),
                 .settings = settings_of(example, given_settings(options.overrides)),
                 .description = {},
                 .start = example.at("start")};
  json settings = json::object();
  for (const NewTaskSetting& setting : study.settings) {
    if (setting.is_set) set_below(settings, split_key(setting.key), json::parse(setting.value));
  }
  const DescribedTask described =
      describe_task(task_content(study.task, settings, nullptr), options.worker_program);
  study.description = described.description;
  study.input_max = input_max(json::parse(described.settings));
  write_new(options.new_file, new_study_text(study));
  fmt::print("{}: a study of {}\nnext: treeroll-learner {}{} --check\n", options.new_file.string(),
             study.task, options.new_file.string(), study.options);
  flush_standard_output();
}

}  // namespace treeroll
