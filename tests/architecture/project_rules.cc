#include <filesystem>
#include <map>
#include <regex>
#include <sstream>

#include "tests/architecture/rooms.h"
#include "tests/architecture/rules.h"

namespace treeroll::architecture {
namespace {

constexpr std::size_t kNumLinesMax = 400;

void check_name(const SourceFile& file, std::vector<Finding>& findings) {
  static const std::regex vague("(^|_)(utils?|helpers?|misc|common_stuff)(_|$)");
  const std::filesystem::path path(file.path);
  for (const std::filesystem::path& part : path.parent_path() / path.stem()) {
    if (std::regex_search(part.string(), vague)) {
      findings.push_back(
          {file.path, 1, "name the file after what it holds, not '" + part.string() + "'"});
    }
  }
  if (file.is_cxx() && !std::regex_match(path.stem().string(), std::regex("[a-z0-9_]+"))) {
    findings.push_back({file.path, 1, "file names are snake_case"});
  }
}

void check_header(const SourceFile& file, std::vector<Finding>& findings) {
  for (std::size_t i = 0; i < file.code.size(); ++i) {
    if (file.code[i].find_first_not_of(' ') == std::string::npos) continue;
    if (file.code[i] == "#pragma once") return;
    findings.push_back({file.path, static_cast<int>(i) + 1, "a header begins with #pragma once"});
    return;
  }
  findings.push_back({file.path, 1, "a header begins with #pragma once"});
}

void check_lines(const SourceFile& file, std::vector<Finding>& findings) {
  static const std::regex left_behind(R"(\b(TODO|FIXME|XXX|HACK)\b)");
  static const std::regex outside(R"(\.\./shared\b|/work/|\b(DESIGN|STYLE|METHOD)\.md\b)");
  static const std::regex flags(R"(-ffast-math|-Ofast|-march=native|-funsafe-math)");
  static const std::regex glob(R"(\bfile\s*\(\s*GLOB)");
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    const int line = static_cast<int>(i) + 1;
    const std::string& text = file.lines[i];
    if (std::regex_search(text, left_behind)) {
      findings.push_back({file.path, line, "finish it, or open an issue and leave no note here"});
    }
    if (std::regex_search(text, outside)) {
      findings.push_back({file.path, line, "the tree stands alone: name nothing outside of it"});
    }
    const std::string code = text.substr(0, text.find('#'));
    if (file.is_cmake() && std::regex_search(code, flags)) {
      findings.push_back({file.path, line, "this flag changes the bits of results"});
    }
    if (file.is_cmake() && std::regex_search(code, glob)) {
      findings.push_back({file.path, line, "list the sources: a glob misses files silently"});
    }
  }
}

/// A call of a CMake command: its first argument and the rest.
struct Call {
  std::string path;
  int line = 0;
  std::string command;
  std::string target;
  std::vector<std::string> arguments;
};

std::vector<Call> find_calls(const SourceFile& file) {
  static const std::regex call(
      R"((add_library|add_executable|target_link_libraries)\s*\(([^)]*)\))");
  std::string text;
  for (const std::string& line : file.lines) text += line.substr(0, line.find('#')) + "\n";
  std::vector<Call> calls;
  for (std::sregex_iterator it(text.begin(), text.end(), call), end; it != end; ++it) {
    const auto before = text.begin() + it->position();
    Call found{
        file.path, static_cast<int>(std::count(text.begin(), before, '\n')) + 1, (*it)[1], "", {}};
    std::istringstream words((*it)[2]);
    words >> found.target;
    for (std::string word; words >> word;) found.arguments.push_back(word);
    calls.push_back(found);
  }
  return calls;
}

}  // namespace

std::vector<Finding> check_project(const SourceFile& file) {
  std::vector<Finding> findings;
  check_name(file, findings);
  if (file.is_header()) check_header(file, findings);
  // These rules' own sources and examples have to spell the words out.
  if (!file.path.starts_with("tests/architecture/")) check_lines(file, findings);
  if (file.is_cxx() && file.lines.size() > kNumLinesMax) {
    findings.push_back({file.path, static_cast<int>(kNumLinesMax),
                        "more than " + std::to_string(kNumLinesMax) + " lines: split the file"});
  }
  return findings;
}

std::vector<Finding> check_message_comments(const SourceFile& file) {
  if (!file.path.ends_with(".lcm")) return {};
  static const std::regex behind_a_field(R"(;.*//)");
  std::vector<Finding> findings;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    if (!std::regex_search(file.lines[i], behind_a_field)) continue;
    if (file.lines[i].find_first_not_of(' ') == file.lines[i].find("//")) continue;
    findings.push_back(
        {file.path, static_cast<int>(i) + 1,
         "put the comment on the line above: lcm-gen may take it for the next field's"});
  }
  return findings;
}

std::vector<Finding> check_links(const std::vector<SourceFile>& files) {
  std::vector<Call> calls;
  std::map<std::string, std::string> room_of_target;
  for (const SourceFile& file : files) {
    const std::string room = room_of(file.path);
    if (!file.is_cmake() || room.empty()) continue;
    for (Call& call : find_calls(file)) {
      if (call.command != "target_link_libraries") room_of_target[call.target] = room;
      calls.push_back(std::move(call));
    }
  }
  std::vector<Finding> findings;
  for (const Call& call : calls) {
    if (call.command != "target_link_libraries") continue;
    const std::string room = room_of(call.path);
    for (const std::string& linked : call.arguments) {
      const auto target = room_of_target.find(linked);
      if (target == room_of_target.end() || reachable(room).contains(target->second)) continue;
      findings.push_back({call.path, call.line,
                          room + " may not link " + linked + " of " + target->second +
                              " (the arrows stand in tests/architecture/rooms.cc)"});
    }
  }
  return findings;
}

std::vector<Finding> check_tree(const std::vector<SourceFile>& files) {
  std::vector<Finding> findings = check_links(files);
  for (const auto check : {check_own_headers, check_local_names}) {
    for (Finding& finding : check(files)) findings.push_back(std::move(finding));
  }
  for (const SourceFile& file : files) {
    for (const auto check : {check_includes, check_words, check_project, check_message_comments}) {
      for (Finding& finding : check(file)) findings.push_back(std::move(finding));
    }
  }
  return findings;
}

std::string to_string(const Finding& finding) {
  return finding.path + ":" + std::to_string(finding.line) + ": " + finding.message;
}

}  // namespace treeroll::architecture
