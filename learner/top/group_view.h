#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/protocol/messages.h"
#include "learner/core/pace.h"

namespace treeroll::top {

/// How a part of a line looks on a terminal that can show it.
enum class Look { kPlain, kQuiet, kHead, kGood, kWarning, kBad, kBar };

struct Span {
  std::string text;  ///< visible ASCII and spaces alone
  Look look = Look::kPlain;
};
using Line = std::vector<Span>;

enum class RunOrder { kNumber, kBest, kWorst };

/// What a person has chosen to see.
struct Choice {
  /// Nothing: one that speaks, if there is one.
  std::optional<protocol::LearnerId> learner = std::nullopt;
  RunOrder order = RunOrder::kNumber;
  std::size_t from = 0;  ///< runs that are scrolled past
};

/// Who is on an LCM group and how far they are, from what everybody there can hear: the status
/// messages of learners, runs and workers. Pure, and bounded whatever is heard.
class GroupView {
 public:
  static constexpr std::size_t kLearnersMax = 32;
  static constexpr std::size_t kWorkersMax = 1000;
  static constexpr std::size_t kRunsMax = 100'000;  ///< of a learner

  /// Whether what is heard is signed and checked; until it is told, it is not.
  void set_verified(bool is_verified) { is_verified_ = is_verified; }
  void hear(const protocol::Message& message, TimePoint now);
  /// Who has been silent for long is shown no more.
  void forget_silent(TimePoint now);

  std::size_t num_learners() const { return learners_.size(); }
  std::size_t num_workers() const { return workers_.size(); }
  /// Of the learner that is shown.
  std::size_t num_runs(const Choice& choice, TimePoint now) const;
  /// The one after that which is shown, and after the last the first.
  std::optional<protocol::LearnerId> next_learner(const Choice& choice, TimePoint now) const;

  /// A screen: `height` lines at most, each at most `width` characters.
  std::vector<Line> lines(const Choice& choice, std::size_t width, std::size_t height,
                          TimePoint now) const;
  /// The same with every learner that is heard.
  std::vector<Line> lines_of_all(std::size_t width, std::size_t height, TimePoint now) const;

 private:
  struct SeenLearner {
    protocol::LearnerStatus status;
    TimePoint heard;
    learner::Pace pace;
    std::map<std::int32_t, protocol::RunStatus> runs;
  };
  struct SeenWorker {
    protocol::WorkerStatus status;  ///< without what it holds
    std::size_t num_held = 0;
    TimePoint heard;
  };
  using Learners = std::map<protocol::LearnerId, SeenLearner>;
  /// Those that speak, then those that are silent.
  std::vector<Learners::const_iterator> in_order(TimePoint now) const;
  /// The place in that order of the one that is shown. Precondition: there are learners.
  std::size_t place_of(const Choice& choice,
                       const std::vector<Learners::const_iterator>& order) const;
  void add_all(const std::vector<Learners::const_iterator>& learners, const Choice& choice,
               std::size_t height, TimePoint now, std::vector<Line>& lines) const;
  void add_learner(const SeenLearner& learner, TimePoint now, std::vector<Line>& lines) const;
  void add_workers(TimePoint now, std::size_t count_max, std::vector<Line>& lines) const;
  void add_runs(const SeenLearner& learner, const Choice& choice, std::size_t height,
                std::vector<Line>& lines) const;

  Learners learners_;
  std::map<protocol::WorkerId, SeenWorker> workers_;
  bool is_verified_ = false;
};

/// As text of its own, without looks.
std::string plain_text(const std::vector<Line>& lines);

}  // namespace treeroll::top
