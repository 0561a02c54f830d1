#pragma once

#include <vector>

namespace treeroll {

/// Puts right what this process inherits from whoever starts it, before anything else is done:
/// - closed descriptors 0, 1 and 2 are opened on /dev/null, or the next file or pipe would take
///   their numbers and what is printed would go there;
/// - signals are unblocked, and the ends of children can be waited for (SIGCHLD);
/// - a reader that has gone (SIGPIPE) and a limit on the size of files (SIGXFSZ) make the write
///   fail, which is then an error with a word. Programs that are started from here have the
///   default again;
/// - the first process of a container (id 1) is parent to all that lose theirs, and would have to
///   reap them: it does that alone from now on, and its child goes on here as the program. It
///   passes signals on, and ends as the child does.
void settle_process();

/// The signals that ask a program to end, SIGTERM, SIGINT and SIGHUP, without those that whoever
/// started it has set to be ignored: nohup does so.
std::vector<int> stop_signals();

/// From now on, until a loop takes the stop signals over, each of them ends this program at once
/// with this exit status and a line on standard error.
/// @param line  with a line break; outlives the program
void end_when_stopped(int exit_status, const char* line);

}  // namespace treeroll
