#include "learner/study/new_study_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

namespace treeroll {
namespace {

constexpr std::size_t kCommentColumn = 28;
constexpr std::size_t kColumns = 100;

/// A line with a comment that stands below those of the other lines, on lines of its own where it
/// is long.
std::string line(const std::string& setting, const std::string& comment) {
  if (comment.empty()) return setting + "\n";
  std::string text = setting;
  std::size_t column = setting.size();
  const auto begin_comment = [&](const char* begin) {
    const std::size_t gap = column < kCommentColumn ? kCommentColumn - column : 2;
    text += std::string(gap, ' ') + begin;
    column += gap + 2;
  };
  begin_comment("# ");
  std::istringstream words(comment);
  bool is_first = true;
  for (std::string word; words >> word; is_first = false) {
    if (!is_first && column + 1 + word.size() > kColumns) {
      text += "\n";
      column = 0;
      begin_comment("# ");
      is_first = true;
    }
    text += (is_first ? "" : " ") + word;
    column += word.size() + (is_first ? 0 : 1);
  }
  return text + "\n";
}

std::string zeros(int count) {
  std::vector<std::string> numbers(static_cast<std::size_t>(count), "0.0");
  return fmt::format("[{}]", fmt::join(numbers, ", "));
}

std::string exploration_from_nothing() {
  return "\n[exploration]\n" +
         line("output_scale = 1.0",
              "how large outputs of a good policy are: the first steps follow");
}

/// A curve over the one input, in four resolutions, that begins with 0.
std::string curve(const NewStudy& study) {
  return "[policy]\n" + line("kind = \"spline\"", "a curve of each output over the one input") +
         line("start = \"constant\"",
              "from nothing; \"fit\" begins with a demonstration of yours") +
         line(fmt::format("range = [0.0, {}]", nlohmann::json(study.input_max).dump()),
              "of the input") +
         line("values = " + zeros(study.description.output_dim), "where each output begins") +
         exploration_from_nothing();
}

/// One Gaussian: a linear feedback of which all gains begin with 0.
std::string feedback(const TaskDescription& task) {
  std::vector<std::string> deviations(static_cast<std::size_t>(task.input_dim + task.output_dim),
                                      "1.0");
  return "[policy]\n" +
         line("start = \"components\"", "one Gaussian: linear feedback, all gains 0 at first") +
         line("layout = \"reduced_cholesky\"", "explored: the mean output and each input's gain") +
         "\n[policy.layer_1]\n" + fmt::format("inputs = {}\n", task.input_dim) +
         line(fmt::format("means = [{}]", zeros(task.input_dim + task.output_dim)),
              "inputs, then outputs") +
         line(fmt::format("deviations = [{}]", fmt::join(deviations, ", ")),
              "how large each of them is") +
         exploration_from_nothing();
}

std::string start_of(const NewStudy& study) {
  if (!study.start.empty()) return study.start;
  return study.description.input_dim == 1 ? curve(study) : feedback(study.description);
}

/// As TOML has a string.
std::string quoted(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

}  // namespace

std::string new_study_text(const NewStudy& study) {
  std::string text = fmt::format(
      "# A study of the task {0}, to begin with.\n"
      "#   treeroll-learner FILE{1} --check            what it would do\n"
      "#   treeroll-learner FILE{1} --local-workers 2  learn it\n"
      "#   treeroll-learner --help-keys             every key there is\n\n[study]\n",
      quoted(study.task), study.options);
  text += line(fmt::format("name = \"{}\"", study.name), "of the folder of the results");
  text += line("rollouts = 300", "of each run");
  text += line("repetitions = 4", "runs, each with random numbers of its own");
  text += "\n[task]\n" + line("name = " + quoted(study.task),
                              "what follows a # is what holds where nothing is said");
  for (const NewTaskSetting& setting : study.settings) {
    text += line(fmt::format("{}{} = {}", setting.is_set ? "" : "# ", setting.key, setting.value),
                 setting.meaning);
  }
  text += "\n" + start_of(study) + "\n[[conditions]]\n";
  text += line("name = \"plain\"", "another one beside it is compared with it");
  return text;
}

}  // namespace treeroll
