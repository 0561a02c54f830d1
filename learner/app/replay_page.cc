#include "learner/app/replay_page.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <exception>
#include <optional>

#include "common/program/host_name.h"
#include "common/program/process_start.h"
#include "common/program/program.h"
#include "learner/app/showing.h"
#include "learner/app/told_record.h"
#include "learner/journal/journal_fold.h"
#include "learner/web/live_page.h"

namespace treeroll {
namespace {

constexpr Duration kLookPeriod = std::chrono::milliseconds(500);

/// Nobody waits for this loop but those who watch.
web::HttpLimits limits() { return {.thread = {.share = .9, .at_once = std::chrono::seconds(1)}}; }

/// A core that follows a journal, and the page that shows it.
class JournalPage {
 public:
  JournalPage(const StateFiles& files, const web::PageOptions& page,
              const WorkerProgram& worker_program)
      : state_(read_state_study(files)),
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

  void run() {
    follow();
    if (failure_) std::rethrow_exception(failure_);
    spdlog::info("the page is {}", page_.url());
    loop_.on_signals(stop_signals(), [this](int) { loop_.stop(); });
    loop_.run();
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  learner::LearnerSettings settings() {
    learner::LearnerSettings settings;
    settings.on_applied = [this](const learner::Run& run, int number) {
      page_.study().applied(run, number);
    };
    return settings;
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
    timer_.set(loop_.now() + kLookPeriod);
  }

  transport::Loop loop_;
  StateStudy state_;
  learner::LearnerCore core_;
  web::LivePage page_;
  JournalFold fold_;
  std::int64_t num_told_ = -1;  ///< records
  transport::Timer timer_{loop_, [this] { follow(); }};
  std::exception_ptr failure_;
};

}  // namespace

void serve_journal(const StateFiles& files, const web::PageOptions& page,
                   const WorkerProgram& worker_program) {
  JournalPage(files, page, worker_program).run();
}

}  // namespace treeroll
