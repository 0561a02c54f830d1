#include "tests/architecture/equation_map.h"

#include <algorithm>
#include <regex>
#include <utility>

namespace treeroll::architecture {
namespace {

/// A row of a table, without its outer bars.
struct Row {
  int line = 0;
  std::vector<std::string> cells;
};

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

std::vector<std::string> split_cells(const std::string& line) {
  std::vector<std::string> cells;
  std::size_t begin = 1;
  for (std::size_t bar = line.find('|', begin); bar != std::string::npos;
       bar = line.find('|', begin)) {
    cells.push_back(line.substr(begin, bar - begin));
    begin = bar + 1;
  }
  return cells;
}

/// Rows of all tables of the section, without their heads and rules.
std::vector<Row> rows_of_section(const SourceFile& file) {
  std::vector<Row> rows;
  bool is_inside = false;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    const std::string& line = file.lines[i];
    if (line.starts_with("## ")) is_inside = line.starts_with("## Equations of the thesis");
    if (!is_inside || !line.starts_with("|") || line.starts_with("|--")) continue;
    const bool is_head = i + 1 < file.lines.size() && file.lines[i + 1].starts_with("|--");
    if (!is_head) rows.push_back({static_cast<int>(i) + 1, split_cells(line)});
  }
  return rows;
}

std::vector<std::string> in_backticks(const std::string& cell) {
  static const std::regex quoted("`([^`]+)`");
  std::vector<std::string> words;
  for (std::sregex_iterator it(cell.begin(), cell.end(), quoted), end; it != end; ++it) {
    words.push_back((*it)[1]);
  }
  return words;
}

/// All names "Suite.Test" below tests/.
std::set<std::string> all_tests(const std::vector<SourceFile>& files) {
  static const std::regex definition(R"(\bTEST(?:_F|_P)?\s*\(\s*(\w+)\s*,\s*(\w+)\s*\))");
  std::set<std::string> names;
  for (const SourceFile& file : files) {
    if (!file.path.starts_with("tests/") || !file.is_cxx()) continue;
    const std::string code = joined(file.code);
    for (std::sregex_iterator it(code.begin(), code.end(), definition), end; it != end; ++it) {
      names.insert((*it)[1].str() + "." + (*it)[2].str());
    }
  }
  return names;
}

bool is_matched(const std::string& name, const std::string& pattern) {
  const std::size_t star = pattern.find('*');
  if (star == std::string::npos) return name == pattern;
  const std::string after = pattern.substr(star + 1);
  return name.size() >= pattern.size() - 1 && name.starts_with(pattern.substr(0, star)) &&
         name.ends_with(after);
}

/// "Gmr::regress" is there if both words are: a header does not spell its class before a member.
bool has_words(const std::string& text, const std::string& name) {
  static const std::regex word(R"(\w+)");
  for (std::sregex_iterator it(name.begin(), name.end(), word), end; it != end; ++it) {
    if (!std::regex_search(text, std::regex("\\b" + it->str() + "\\b"))) return false;
  }
  return true;
}

/// What the rows of one map are held against.
class MapCheck {
 public:
  explicit MapCheck(const std::vector<SourceFile>& files)
      : files_(files), tests_(all_tests(files)) {}

  void check(const Row& row) {
    line_ = row.line;
    if (row.cells.size() < 2 || row.cells.size() > 3) {
      fail("a row has an equation, a function and a test, or an equation and a reason");
      return;
    }
    for (const std::string& equation : equations_in(row.cells[0])) named_.insert(equation);
    if (row.cells.size() == 2) return;
    check_functions(in_backticks(row.cells[1]));
    check_tests(in_backticks(row.cells[2]));
  }

  void check_whole() {
    for (const auto& [chapter, count] : thesis_equations()) {
      for (int i = 1; i <= count; ++i) {
        const std::string equation = "(" + chapter + "-" + std::to_string(i) + ")";
        if (!named_.contains(equation)) fail("equation " + equation + " is missing from the map");
      }
    }
  }

  std::vector<Finding> take_findings() { return std::move(findings_); }

 private:
  void fail(const std::string& message) {
    findings_.push_back({std::string(kEquationMapPath), line_, message});
  }

  void check_functions(const std::vector<std::string>& words) {
    if (words.empty()) fail("names no function in backticks");
    for (const std::string& word : words) {
      if (word.find('/') != std::string::npos) {
        const auto found = std::find_if(files_.begin(), files_.end(),
                                        [&](const SourceFile& file) { return file.path == word; });
        file_ = found == files_.end() ? nullptr : &*found;
        if (!file_) fail("there is no file " + word);
      } else if (file_ && !has_words(joined(file_->is_cxx() ? file_->code : file_->lines), word)) {
        fail(word + " is not in " + file_->path);
      }
    }
  }

  void check_tests(const std::vector<std::string>& patterns) {
    if (patterns.empty()) fail("names no test in backticks");
    for (const std::string& pattern : patterns) {
      const std::size_t dot = pattern.find('.');
      if (dot == std::string::npos) {
        fail(pattern + " is no test: write `Suite.Name`");
        continue;
      }
      if (dot > 0) suite_ = pattern.substr(0, dot);
      const std::string full = suite_ + pattern.substr(dot);
      const bool exists = std::any_of(tests_.begin(), tests_.end(), [&](const std::string& name) {
        return is_matched(name, full);
      });
      if (!exists) fail("there is no test " + full);
    }
  }

  const std::vector<SourceFile>& files_;
  std::set<std::string> tests_;
  std::set<std::string> named_;
  const SourceFile* file_ = nullptr;  // named last
  std::string suite_;                 // named last
  int line_ = 1;                      // of the row looked at last
  std::vector<Finding> findings_;
};

}  // namespace

std::set<std::string> equations_in(const std::string& text) {
  static const std::regex number(R"(\((\d|[AB])-(\d+)\)(?: to \(\1-(\d+)\))?)");
  std::set<std::string> equations;
  for (std::sregex_iterator it(text.begin(), text.end(), number), end; it != end; ++it) {
    const int first = std::stoi((*it)[2]);
    const int last = (*it)[3].matched ? std::stoi((*it)[3]) : first;
    for (int i = first; i <= last; ++i) {
      equations.insert("(" + (*it)[1].str() + "-" + std::to_string(i) + ")");
    }
  }
  return equations;
}

const std::map<std::string, int>& thesis_equations() {
  static const std::map<std::string, int> counts = {
      {"2", 7}, {"3", 18}, {"4", 7}, {"A", 37}, {"B", 7}};
  return counts;
}

std::vector<Finding> check_equation_map(const std::vector<SourceFile>& files) {
  MapCheck map(files);
  for (const SourceFile& file : files) {
    if (file.path != kEquationMapPath) continue;
    for (const Row& row : rows_of_section(file)) map.check(row);
    map.check_whole();
  }
  return map.take_findings();
}

}  // namespace treeroll::architecture
