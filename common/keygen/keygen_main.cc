#include <fcntl.h>
#include <fmt/format.h>
#include <sys/random.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

#include "common/base/check.h"
#include "common/base/config_error.h"
#include "common/program/program.h"
#include "common/program/random_id.h"
#include "common/program/standard_output.h"
#include "common/transport/key_file.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWorkerOf = "--worker-of";
constexpr const char* kSameWorkerAs = "--same-worker-as";

transport::Key random_key() {
  transport::Key key{};
  CHECK(getrandom(key.data(), key.size(), 0) == static_cast<ssize_t>(key.size()),
        "no random numbers");
  return key;
}

std::string learner_text() {
  return "# A learner's key of treeroll-keygen: who has it speaks as a learner and as any "
         "worker.\n" +
         transport::line_of(random_key()) + "\n";
}

/// A worker keeps its id when its key changes: it would not be known again while it runs.
std::int64_t worker_id(const fs::path& same_as) {
  const auto file = transport::key_file_of(kSameWorkerAs, same_as, transport::Voice::kWorker);
  if (!file) return random_id();
  if (file->keys().is_learners()) {
    throw ConfigError(kSameWorkerAs, same_as.string(), "must hold a worker's key");
  }
  return file->keys().worker_keys().front().id;
}

/// Of the worker, for each of the learner's keys.
std::string worker_text(const fs::path& learner_file, std::int64_t id) {
  const auto learner = transport::key_file_of(kWorkerOf, learner_file, transport::Voice::kLearner);
  std::string text =
      "# A worker's key of treeroll-keygen: who has it speaks as this worker alone.\n";
  for (const transport::Key& key : learner->keys().learner_keys()) {
    text += transport::line_of(transport::worker_key(key, id)) + "\n";
  }
  return text;
}

/// Readable by its owner alone from its first moment.
void write_new(const fs::path& path, const std::string& text) {
  const auto fail = [&path] {
    throw std::system_error(errno, std::generic_category(), "cannot write " + path.string());
  };
  const int descriptor =
      open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (descriptor < 0 && errno == EEXIST) {
    throw ConfigError("FILE", path.string(), "must not exist: a key is never overwritten");
  }
  if (descriptor < 0) fail();
  const ssize_t written = write(descriptor, text.data(), text.size());
  const bool is_whole = written == static_cast<ssize_t>(text.size()) && fsync(descriptor) == 0;
  if (!is_whole) fail();
  if (close(descriptor) != 0) fail();
}

int keygen_main(int argc, char** argv) {
  fs::path file;
  fs::path learner_file;
  fs::path same_as;
  return run_main(
      argc, argv,
      {.name = "treeroll-keygen",
       .purpose = "Makes a key file for --key-file of the daemons: a learner's, or a worker's.",
       .examples = {{"treeroll-keygen learner.key", "for treeroll-learner --key-file learner.key"},
                    {"treeroll-keygen host7.key --worker-of learner.key",
                     "for treeroll-worker --key-file host7.key"}},
       .options =
           [&](CommandLine& line) {
             line.add("FILE", file, "The new file").required();
             const Option worker_of = line.add(
                 kWorkerOf, learner_file,
                 "A learner's key file: make one for the workers of a host, with which nobody "
                 "speaks as a learner or as another worker");
             line.add(kSameWorkerAs, same_as,
                      "With --worker-of: the worker's key file so far, whose id it keeps, so that "
                      "its key can change while it runs")
                 .needs(worker_of);
             line.end_help_with(
                 "A daemon looks at its file every two seconds: of several lines it signs with the "
                 "first and takes what is signed with any, so keys change without a stop.");
           },
       .work =
           [&] {
             write_new(file, learner_file.empty() ? learner_text()
                                                  : worker_text(learner_file, worker_id(same_as)));
             fmt::print("{}\n", file.string());
             flush_standard_output();
             return kExitDone;
           }});
}

}  // namespace
}  // namespace treeroll

int main(int argc, char** argv) { return treeroll::keygen_main(argc, argv); }
