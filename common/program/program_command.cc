#include "common/program/program_command.h"

#include <sys/stat.h>
#include <unistd.h>
#include <wordexp.h>

#include <cstdlib>
#include <sstream>

#include "common/base/config_error.h"

namespace treeroll {
namespace {

/// As execvp() looks for it.
bool is_found(const std::string& program) {
  if (program.find('/') != std::string::npos) return can_be_executed(program);
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "/bin:/usr/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (can_be_executed((folder.empty() ? "." : folder) + "/" + program)) return true;
  }
  return false;
}

}  // namespace

bool can_be_executed(const std::filesystem::path& file) {
  struct stat facts {};
  return access(file.c_str(), X_OK) == 0 && stat(file.c_str(), &facts) == 0 &&
         S_ISREG(facts.st_mode);
}

std::vector<std::string> read_program_command(const std::string& option, const std::string& text) {
  wordexp_t found{};
  const int error = text.find('\0') == std::string::npos
                        ? wordexp(text.c_str(), &found, WRDE_NOCMD | WRDE_UNDEF)
                        : WRDE_BADCHAR;
  std::vector<std::string> words;
  if (error == 0) words.assign(found.we_wordv, found.we_wordv + found.we_wordc);
  if (error == 0 || error == WRDE_NOSPACE) wordfree(&found);
  if (error == WRDE_BADVAL) {
    throw ConfigError(option, text, "names a variable of the environment that is not set");
  }
  if (error != 0) {
    throw ConfigError(option, text,
                      "must be a program and its arguments: what only a shell can carry out, such "
                      "as | & ; < > or $(), goes into sh -c '...'");
  }
  if (words.empty()) throw ConfigError(option, text, "must name a program");
  if (!is_found(words.front())) {
    throw ConfigError(option, text, "must name a program that can be executed");
  }
  return words;
}

}  // namespace treeroll
