#pragma once

#include <string>
#include <vector>

#include "tests/architecture/source_file.h"

namespace treeroll::architecture {

/// A broken rule: where, what, and what to do instead.
struct Finding {
  std::string path;
  int line = 0;  ///< from 1
  std::string message;
};

/// "path:line: message", as compilers write it.
std::string to_string(const Finding& finding);

/// Includes: along the arrows of rooms.h, from the root; LCM only in common/transport, ODE only in
/// sim; libraries that take seconds to compile only in .cc files.
std::vector<Finding> check_includes(const SourceFile& file);

/// A room's source includes its own header before all else: so each header is compiled alone.
std::vector<Finding> check_own_headers(const std::vector<SourceFile>& files);

/// What a core or a portable room must not name: clocks, random devices, the standard library's
/// distributions, unordered containers, threads, disk and network, glibc's elementary functions.
std::vector<Finding> check_words(const SourceFile& file);

/// What holds for every text file: its name, its length, words left behind, `#pragma once`, and
/// compiler flags that change results.
std::vector<Finding> check_project(const SourceFile& file);

/// Comments of a message type stand above their field: newer versions of lcm-gen attach one behind
/// a field to the field after it.
std::vector<Finding> check_message_comments(const SourceFile& file);

/// Link lines of all CMake files: a room's targets link only targets of rooms it may include.
std::vector<Finding> check_links(const std::vector<SourceFile>& files);

/// Arrows of rooms.h along which no source of a whole tree includes anything: an arrow that stands
/// there unused lets the next include pass that nobody has thought about.
std::vector<Finding> check_unused_arrows(const std::vector<SourceFile>& files);

/// Names in the unnamed namespaces of one folder's sources, which are compiled several as one: each
/// belongs to one source. The compiler refuses the same thing twice; of two functions that differ
/// in their arguments it would quietly take the better match.
std::vector<Finding> check_local_names(const std::vector<SourceFile>& files);

/// All that can be said of any set of files: all of the above but the unused arrows.
std::vector<Finding> check_tree(const std::vector<SourceFile>& files);

}  // namespace treeroll::architecture
