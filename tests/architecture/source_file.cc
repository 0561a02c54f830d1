#include "tests/architecture/source_file.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <regex>
#include <utility>

namespace treeroll::architecture {
namespace {

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// Position after the literal or comment that begins at `begin`, or `begin` if none does.
std::size_t end_of_non_code(std::string_view text, std::size_t begin) {
  const auto after = [&](std::string_view closing, std::size_t from) {
    const std::size_t found = text.find(closing, from);
    return found == std::string_view::npos ? text.size() : found + closing.size();
  };
  const std::string_view rest = text.substr(begin);
  if (rest.starts_with("//")) return std::min(text.find('\n', begin), text.size());
  if (rest.starts_with("/*")) return after("*/", begin + 2);
  if (rest.starts_with("R\"") && (begin == 0 || !is_word(text[begin - 1]))) {
    const std::size_t open = text.find('(', begin);
    if (open == std::string_view::npos) return text.size();
    const std::string closing = ")" + std::string(text.substr(begin + 2, open - begin - 2)) + "\"";
    return after(closing, open);
  }
  // A quote inside a number separates its digits: 65'000.
  const bool separates = text[begin] == '\'' && begin > 0 && is_word(text[begin - 1]);
  if (text[begin] != '"' && (text[begin] != '\'' || separates)) return begin;
  for (std::size_t i = begin + 1; i < text.size(); ++i) {
    if (text[i] == '\\') {
      ++i;
    } else if (text[i] == text[begin] || text[i] == '\n') {
      return text[i] == '\n' ? i : i + 1;
    }
  }
  return text.size();
}

/// The text with comments and literals turned into spaces; line ends stay where they are.
std::string blanked(std::string_view text) {
  std::string code(text);
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t end = end_of_non_code(text, i);
    std::replace_if(
        code.begin() + static_cast<std::ptrdiff_t>(i),
        code.begin() + static_cast<std::ptrdiff_t>(end), [](char c) { return c != '\n'; }, ' ');
    i = std::max(end, i + 1);
  }
  return code;
}

std::vector<std::string> split_lines(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

std::vector<Include> find_includes(const SourceFile& file) {
  static const std::regex directive(R"re(^\s*#\s*include\s*(["<])([^">]+)[">])re");
  std::vector<Include> includes;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    // Blanking leaves the '#' of a directive, not that of one in a comment or a literal.
    std::smatch match;
    if (file.code[i].find('#') != std::string::npos &&
        std::regex_search(file.lines[i], match, directive)) {
      includes.push_back({static_cast<int>(i) + 1, match[1] == "\"", match[2]});
    }
  }
  return includes;
}

/// By the end of the name; none at all for scripts and dotfiles. A ".git" file marks a checkout
/// that shares its history with another, and names a folder outside.
bool is_text(const std::filesystem::path& path) {
  if (path.filename() == ".git") return false;
  static const std::vector<std::string> endings = {
      "", ".h", ".cc", ".cmake", ".txt", ".md", ".toml", ".lcm", ".json", ".service", ".py", ".sh"};
  return std::find(endings.begin(), endings.end(), path.extension()) != endings.end();
}

SourceFile read_file(const std::filesystem::path& root, const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  return make_source_file(std::filesystem::relative(path, root).generic_string(), text);
}

}  // namespace

SourceFile make_source_file(std::string path, std::string_view text) {
  SourceFile file{std::move(path), split_lines(text), {}, {}};
  if (file.is_cxx()) {
    file.code = split_lines(blanked(text));
    file.includes = find_includes(file);
  }
  return file;
}

std::vector<SourceFile> read_tree(const std::filesystem::path& root) {
  namespace fs = std::filesystem;
  std::vector<SourceFile> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(root)) {
    if (entry.is_regular_file() && is_text(entry.path())) {
      files.push_back(read_file(root, entry.path()));
    }
  }
  for (const char* folder :
       {"common", "sim", "workers", "learner", "lcmtypes", "tests", "deploy"}) {
    if (!fs::exists(root / folder)) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / folder)) {
      if (entry.is_regular_file() && is_text(entry.path())) {
        files.push_back(read_file(root, entry.path()));
      }
    }
  }
  std::sort(files.begin(), files.end(),
            [](const SourceFile& a, const SourceFile& b) { return a.path < b.path; });
  return files;
}

const SourceFile& file_of(const std::vector<SourceFile>& tree, const std::string& path) {
  return *std::find_if(tree.begin(), tree.end(),
                       [&](const SourceFile& file) { return file.path == path; });
}

}  // namespace treeroll::architecture
