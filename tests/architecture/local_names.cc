#include <map>
#include <regex>

#include "tests/architecture/rules.h"

namespace treeroll::architecture {
namespace {

/// Functions, variables and types of the unnamed namespaces of a source, with their lines.
std::map<std::string, int> local_names(const SourceFile& file) {
  static const std::regex declaration(
      R"(^[A-Za-z_][\w:<>,&*\s]*?[\s&*](\w+)\s*(\(|=|\{|\[|;|:(?!:)))");
  static const std::regex other(
      R"(^(template|using|friend|return|static_assert|namespace|public|private|protected)\b|^[A-Z_]+\()");
  std::map<std::string, int> names;
  bool is_local = false;
  for (std::size_t i = 0; i < file.code.size(); ++i) {
    const std::string& line = file.code[i];
    if (line == "namespace {") is_local = true;
    if (file.lines[i] == "}  // namespace") is_local = false;
    // Most lines are indented: the regular expressions, slow as they are, see none of those.
    if (!is_local || line.empty() || line.front() == ' ' || line.front() == '}') continue;
    constexpr auto kAtStart = std::regex_constants::match_continuous;
    std::smatch match;
    if (std::regex_search(line, other, kAtStart)) continue;
    if (!std::regex_search(line, match, declaration, kAtStart) || match[1] == "final") continue;
    names.emplace(match[1], static_cast<int>(i) + 1);
  }
  return names;
}

}  // namespace

std::vector<Finding> check_local_names(const std::vector<SourceFile>& files) {
  std::map<std::string, std::map<std::string, std::string>> owners;  // by folder, by name
  std::vector<Finding> findings;
  for (const SourceFile& file : files) {
    if (!file.path.ends_with(".cc")) continue;
    auto& of_folder = owners[file.path.substr(0, file.path.rfind('/'))];
    for (const auto& [name, line] : local_names(file)) {
      const auto [owner, is_new] = of_folder.emplace(name, file.path);
      if (is_new) continue;
      findings.push_back({file.path, line,
                          "'" + name + "' is also a name in " + owner->second +
                              ": both may be compiled as one source, where a call may find either; "
                              "share it, or name it after what it does here"});
    }
  }
  return findings;
}

}  // namespace treeroll::architecture
