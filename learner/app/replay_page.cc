#include "learner/app/replay_page.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <exception>
#include <filesystem>
#include <string>
#include <system_error>

#include "common/program/host_name.h"
#include "common/program/process_start.h"
#include "common/program/program.h"
#include "learner/app/showing.h"
#include "learner/app/told_record.h"
#include "learner/journal/journal_fold.h"
#include "learner/results/state_directory.h"
#include "learner/state/state_study.h"
#include "learner/web/live_page.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;

constexpr Duration kLookPeriod = std::chrono::milliseconds(500);

/// Nobody waits for this loop but those who watch.
web::HttpLimits limits() { return {.thread = {.share = .9, .at_once = std::chrono::seconds(1)}}; }

/// A core that follows a journal, and the page that shows it.
class JournalPage {
 public:
  JournalPage(transport::Loop& loop, const StateFiles& files, const web::PageOptions& page,
              const WorkerProgram& worker_program)
      : loop_(loop),
        files_(files),
        study_written_at_(study_written_at()),
        state_(read_state_study(files)),
        core_(state_.loaded.study, settings()),
        page_(loop_, page, core_,
              {.program = program_version(),
               .host_name = host_name(),
               .incarnation =
                   fmt::format("replay {} {}", getpid(), loop_.now().time_since_epoch().count()),
               .directory = files.directory.string(),
               .is_replay = true,
               .columns = state_.loaded.columns,
               .demonstrations = state_.loaded.demonstrations},
              showing_program(files.journal, worker_program), limits()),
        fold_(files.journal, state_.in_journal, loop_.now(), core_,
              {.after = [this](const JournalRecord& record) { tell(page_.study(), record); }}) {}

  /// Folds what there is.
  void begin() {
    follow();
    if (failure_) std::rethrow_exception(failure_);
    spdlog::info("the page is {}", page_.url());
  }

  /// Until the loop is stopped. @return  the study has been extended
  bool run() {
    loop_.run();
    if (failure_) std::rethrow_exception(failure_);
    return is_extended_;
  }

  /// Where it listens, as --http has it.
  std::string address() const {
    const std::string url = page_.url();
    const std::size_t begin = url.find("//") + 2;
    return url.substr(begin, url.find('/', begin) - begin);
  }

 private:
  learner::LearnerSettings settings() {
    learner::LearnerSettings settings;
    settings.on_applied = [this](const learner::Run& run, int number) {
      page_.study().applied(run, number);
    };
    return settings;
  }

  /// Of a file that is gone another time than of any that is there.
  fs::file_time_type study_written_at() const {
    std::error_code is_gone;
    return fs::last_write_time(study_of(files_.directory), is_gone);
  }

  /// Of a journal that has not grown nothing is read, and nothing told.
  void follow() {
    std::int64_t num_records = 0;
    try {
      num_records = fold_.go_on(loop_.now()).num_records;
    } catch (const std::exception&) {
      failure_ = std::current_exception();
      return loop_.stop();
    }
    if (num_records != num_told_) page_.study().note(core_.status(loop_.now()), loop_.now());
    num_told_ = num_records;
    // study.toml is written first. From then on --show, which reads it, goes by its numbers of
    // runs.
    is_extended_ = fold_.is_past() || study_written_at() != study_written_at_;
    if (is_extended_) return loop_.stop();
    timer_.set(loop_.now() + kLookPeriod);
  }

  transport::Loop& loop_;
  StateFiles files_;
  fs::file_time_type study_written_at_;
  StateStudy state_;
  learner::LearnerCore core_;
  web::LivePage page_;
  JournalFold fold_;
  std::int64_t num_told_ = -1;  ///< records
  transport::Timer timer_{loop_, [this] { follow(); }};
  std::exception_ptr failure_;
  bool is_extended_ = false;
};

}  // namespace

void serve_journal(const StateFiles& files, const web::PageOptions& page,
                   const WorkerProgram& worker_program) {
  transport::Loop loop;
  web::PageOptions same = page;
  for (bool is_first = true;; is_first = false) {
    JournalPage shown(loop, files, same, worker_program);
    shown.begin();
    if (is_first) loop.on_signals(stop_signals(), [&loop](int) { loop.stop(); });
    if (!shown.run()) return;
    spdlog::info("the study has been extended: it is read anew");
    same.address = shown.address();
  }
}

}  // namespace treeroll
