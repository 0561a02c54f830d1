#include "learner/study/resolved_study.h"

#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/settings/settings_reader.h"
#include "learner/study/toml_depth.h"
#include "learner/study/toml_source.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr const char* kResolvedComment =
    "# Every setting of the study, defaults included: this file can be run again.\n";
/// More than the comment, [written_by] and [study] take.
constexpr std::size_t kHeadBytesMax = 2048;

std::string to_toml(const json& condition) {
  std::string text = "\n[[conditions]]\n";
  append_toml(condition, "conditions", text);
  return text;
}

void check(StudyBytes bytes) {
  if (bytes.bare > kStudyBytesMax) {
    throw ConfigError("", "",
                      fmt::format("the study is too large: with all settings of each condition it "
                                  "must be at most {} bytes",
                                  kStudyBytesMax));
  }
  if (bytes.all > kStudyFileBytesMax) {
    throw ConfigError("", "",
                      fmt::format("the study is too large: with all settings, demonstrations and "
                                  "start policies it must be at most {} bytes",
                                  kStudyFileBytesMax));
  }
}

}  // namespace

std::string ResolvedStudy::to_toml(const std::string& program) const {
  std::string text = kResolvedComment;
  json written_by{{"format", kStudyFormat}};
  if (!program.empty()) written_by["program"] = program;
  append_toml(json{{"written_by", written_by}}, "", text);
  append_toml(json{{"study", *study}}, "", text);
  for (const auto& condition : conditions) text += treeroll::to_toml(*condition);
  if (const std::string stored = store.to_toml(); !stored.empty()) text += "\n" + stored;
  check(StudyBytes{bytes_beside_long_strings(text), text.size()});
  return text;
}

void add_condition_bytes(const json& condition, StudyBytes& bytes) {
  const std::string text = treeroll::to_toml(condition);
  bytes.bare += bytes_beside_long_strings(text);
  bytes.all += text.size();
  check({bytes.bare + kHeadBytesMax, bytes.all + kHeadBytesMax});
}

namespace {

void check_written_by(const json& document) {
  const auto found = document.find("written_by");
  if (found == document.end()) return;
  if (!found->is_object()) throw ConfigError("written_by", found->dump(), "must be a table");
  // A later form may have other keys here: its number and who wrote it come first.
  json read;
  SettingsReader reader(*found, "written_by", read);
  const auto format = reader.integer("format", 1, std::numeric_limits<int>::max());
  const std::string program = reader.string("program", "");
  if (format > kStudyFormat) {
    reader.refuse("format",
                  fmt::format("this program reads forms up to {}: take treeroll {}", kStudyFormat,
                              program.empty() ? "of the version that wrote it" : program));
  }
  reader.finish();
}

}  // namespace

void refuse_later_form(const json& document, const SettingOrigins& origins) {
  try {
    check_written_by(document);
  } catch (const ConfigError& error) {
    throw StudyError(origin_of(origins, error.key()), error);
  }
}

std::string read_study_name(const std::filesystem::path& study_file) {
  json document;
  const SettingOrigins origins = read_toml_file(study_file, document, "[study] with a name");
  refuse_later_form(document, origins);
  const json::json_pointer name("/study/name");
  if (document.contains(name) && document[name].is_string()) return document[name];
  throw StudyError(origin_of(origins, "study.name"),
                   ConfigError("study.name", "", "must be a string"));
}

}  // namespace treeroll
