#include "learner/fit/demonstration_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <vector>

#include "common/settings/settings_reader.h"
#include "learner/fit/demonstration.h"
#include "learner/fit/missing_outputs.h"

namespace treeroll {
namespace {

constexpr std::size_t kFilesMax = 1000;
constexpr std::size_t kUsedColumnsMax = 31;
constexpr double kRegularisationShare = 1e-4;

Demonstration cart_acceleration(SettingsReader& reader) {
  CartAcceleration settings;
  settings.duration_s = reader.number("duration_s", {.min = 1e-3, .max = 1e6}, settings.duration_s,
                                      {.meaning = "Of the demonstration", .unit = "s"});
  settings.num_samples =
      static_cast<int>(reader.integer("samples", 2, 100000, settings.num_samples,
                                      {.meaning = "Of the demonstration, equally spaced in time"}));
  const std::vector<double> p =
      reader.numbers("p", {.min = -1e6, .max = 1e6}, settings.p_m.size(), settings.p_m.size(),
                     std::vector<double>(settings.p_m.begin(), settings.p_m.end()),
                     {.meaning = "Amplitudes of (4-5)", .unit = "m"});
  for (std::size_t i = 0; i < p.size(); ++i) settings.p_m[i] = p[i];
  Demonstration result;
  result.data = demonstrate(settings);
  result.regularisation = Eigen::Vector2d(1e-3, 1);
  return result;
}

Alignment read_alignment(SettingsReader& reader, std::size_t num_files, int num_inputs) {
  const auto& names = kAlignmentNames;
  const std::string word = reader.choice(
      "align", {names[0], names[1], names[2]}, "none",
      {.meaning = "How several recordings over one input, the time, are put on one time: as they "
                  "are, by their durations, or by dynamic time warping, of which kind \"ds_gmr\" "
                  "can take no accelerations"});
  const auto index = std::find(std::begin(names), std::end(names), word) - std::begin(names);
  const auto alignment = static_cast<Alignment>(index);
  if (alignment == Alignment::kNone) return alignment;
  if (num_files < 2) reader.refuse("align", "aligns several files: there is one");
  if (num_inputs != 1) {
    reader.refuse("align", fmt::format("aligns over the time, the one input: there are {} inputs",
                                       num_inputs));
  }
  return alignment;
}

CsvDemonstration read_files(SettingsReader& reader, const std::vector<std::string>& columns,
                            int num_inputs, std::size_t num_needed, const FileReader& read_file) {
  const std::vector<std::string> files = reader.strings(
      "files", kFilesMax,
      {.meaning = "CSV files, a row an observation, relative to the study's folder; several are "
                  "set beside each other. Needed where content stands for nothing",
       .example = "[\"first.csv\"]"});
  const Alignment alignment = read_alignment(reader, files.size(), num_inputs);
  CsvDemonstration demonstration;
  try {
    demonstration = read_demonstration_files(files, columns, read_file, alignment, num_needed);
  } catch (const DemonstrationError& error) {
    reader.refuse("files", error.what());
  }
  const std::string content =
      reader.string("content", demonstration.content,
                    {.meaning = "Hash of the data: refused where the files have another",
                     .otherwise = "that of the files"});
  if (content != demonstration.content && content != demonstration.content_of_files) {
    reader.refuse("content", "the files have changed: their content is " + demonstration.content);
  }
  return demonstration;
}

/// A resolved study holds the data itself, under the name of their content.
CsvDemonstration find_content(SettingsReader& reader, const std::vector<std::string>& columns,
                              std::size_t num_needed, const FileReader& find) {
  const std::string content =
      reader.string("content", {},
                    {.meaning = "Without files: the study's table demonstrations has the data "
                                "under this hash, as in a resolved study"});
  try {
    if (!find) throw DemonstrationError("there are no demonstrations here");
    return read_demonstration_text(find(content), content, columns, num_needed);
  } catch (const DemonstrationError& error) {
    reader.refuse("content", error.what());
  }
}

Demonstration from_table(SettingsReader& reader, const StartSources& sources) {
  std::vector<std::string> columns = reader.strings(
      "inputs", kUsedColumnsMax,
      {.meaning = "Names of the columns that are the policy's inputs", .example = "[\"t_s\"]"});
  Demonstration result;
  result.input_dim = static_cast<int>(columns.size());
  for (std::string& output :
       reader.strings("outputs", kUsedColumnsMax + 1 - columns.size(),
                      {.meaning = "Names of the columns that are its outputs; inputs and outputs "
                                  "are at most 32 together",
                      .example = "[\"x_m\"]"})) {
    if (std::find(columns.begin(), columns.end(), output) != columns.end()) {
      reader.refuse("outputs", "must not name a column that stands among inputs or outputs");
    }
    columns.push_back(std::move(output));
  }
  // Only where it is there: a resolved study of an earlier version has no such key.
  const bool may_miss =
      reader.has("missing_outputs") &&
      reader.boolean("missing_outputs", {},
                     {.meaning = "Whether fields of outputs may be empty, of which each row has "
                                 "one at least; not with fit.start = \"kmeans\"",
                      .otherwise = "false"});
  const std::size_t num_needed = may_miss ? static_cast<std::size_t>(result.input_dim) : kAllNeeded;
  const bool has_data = reader.has("content") && !reader.has("files");
  const CsvDemonstration demonstration =
      has_data ? find_content(reader, columns, num_needed, sources.find_demonstration)
               : read_files(reader, columns, result.input_dim, num_needed, sources.read_file);
  const Eigen::VectorXd variance = variances(demonstration.data);
  for (Eigen::Index i = 0; i < result.input_dim; ++i) {
    if (variance[i] > 0) continue;
    reader.refuse("inputs", fmt::format("column \"{}\" of the files does not vary",
                                        columns[static_cast<std::size_t>(i)]));
  }
  for (Eigen::Index i = result.input_dim; i < demonstration.data.rows(); ++i) {
    if (!demonstration.data.row(i).array().isNaN().all()) continue;
    reader.refuse("outputs", fmt::format("column \"{}\" of the files has no number",
                                         columns[static_cast<std::size_t>(i)]));
  }
  result.data = demonstration.data;
  result.text = demonstration.text;
  result.alignment = demonstration.alignment;
  result.regularisation = kRegularisationShare * variance;
  result.output_deviation = std::sqrt(variance.tail(variance.size() - 1).maxCoeff());
  return result;
}

}  // namespace

bool Demonstration::output_varies(Eigen::Index output) const {
  return variances(data.row(input_dim + output))[0] > 0;
}

Demonstration read_demonstration(SettingsReader reader, const StartSources& sources) {
  const bool is_csv =
      reader.choice("kind", {"cart_acceleration", "csv"}, "cart_acceleration",
                    {.meaning = "The cart's acceleration over time of (4-5), or CSV files"}) ==
      "csv";
  Demonstration demonstration = is_csv ? from_table(reader, sources) : cart_acceleration(reader);
  reader.finish();
  return demonstration;
}

}  // namespace treeroll
