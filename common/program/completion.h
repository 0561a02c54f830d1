#pragma once

#include <functional>
#include <map>
#include <string>

#include "common/program/manual.h"

namespace treeroll {

/// What makes a shell complete the options of a program, the words that they may have, and names of
/// files: the text of a file that the shell reads, by the shell's name.
///
/// - bash: share/bash-completion/completions/PROGRAM
/// - fish: share/fish/vendor_completions.d/PROGRAM.fish
/// - zsh: share/zsh/site-functions/_PROGRAM; below /usr Debian has vendor-completions instead
const std::map<std::string, std::function<std::string(const Manual&)>>& completions();

}  // namespace treeroll
