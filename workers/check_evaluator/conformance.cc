#include "workers/check_evaluator/conformance.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "common/base/config_error.h"
#include "common/base/time.h"
#include "common/policy/kinds/standard_policies.h"
#include "workers/check_evaluator/sample_policy.h"
#include "workers/tasks/trace.h"
#include "workers/user_program/family_time.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;
using Verdict = Finding::Verdict;

constexpr const char* kPolicyOption = "--policy";

// Their numbers in EVALUATOR.md.
constexpr int kRuleOfAnswers = 3;
constexpr int kRuleOfTime = 17;

/// A text longer than a pipe holds.
constexpr int kManyGaussians = 1500;
/// Half of those that a study draws are above the integers of 64 bits with a sign.
constexpr std::uint64_t kLargeSeed = 0xF123'4567'89AB'CDEF;
constexpr std::uint64_t kSmallSeed = 100;
/// A trial may be void, and one of a noisy task may fail by chance.
constexpr int kTrialsMax = 3;
/// In this time a second answer, or an end, has come if it comes.
constexpr std::chrono::milliseconds kPatience(300);
constexpr std::chrono::seconds kEndLimit(5);

class Conformance {
 public:
  explicit Conformance(const ConformanceRun& run)
      : run_(run), settings_(json::parse(run.settings)) {}

  std::vector<Finding> check() {
    try {
      start();
      if (!describe()) return std::move(findings_);
      if (moves_unasked()) {
        end();
      } else if (find_policies()) {
        evaluate();
      }
    } catch (const ProgramEnded& ended) {
      add(ended.rule, Verdict::kBroken, ended.what);
    } catch (const ConfigError& error) {
      if (error.key() == kPolicyOption) throw;
      add(9, Verdict::kBroken, error.what());
    } catch (const std::runtime_error& error) {
      add(1, Verdict::kBroken, error.what());
    }
    return std::move(findings_);
  }

 private:
  void add(int rule, Verdict verdict, std::string what) {
    findings_.push_back({rule, verdict, std::move(what)});
  }
  void judge(int rule, bool kept, const std::string& is_kept, const std::string& is_broken,
             Verdict otherwise = Verdict::kBroken) {
    add(rule, kept ? Verdict::kKept : otherwise, kept ? is_kept : is_broken);
  }

  void start() { program_.emplace(run_.program, run_.log); }

  DescribeAnswer ask_to_describe(const json& settings) {
    program_->set_answer_limit(run_.answer_limit);
    return program_->describe(run_.task, settings);
  }

  bool describe() {
    try {
      task_ = ask_to_describe(settings_);
    } catch (const ConfigError& error) {
      add(8, Verdict::kBroken, error.what());
      return false;
    }
    add(8, Verdict::kKept,
        fmt::format("describes its task: {} inputs, {} outputs, rewards {} .. {}",
                    task_.description.input_dim, task_.description.output_dim,
                    task_.description.reward_min, task_.description.reward_max));
    const json resolved = task_.settings ? json::parse(*task_.settings) : settings_;
    const DescribeAnswer again = ask_to_describe(resolved);
    judge(9, again.description == task_.description && again.settings == task_.settings,
          "says the same of the settings it has given",
          "describes the settings it has given otherwise: " + again.settings.value_or("none"));
    refuses_unknown_setting();
    return true;
  }

  void refuses_unknown_setting() {
    constexpr const char* kNobodysKey = "no_task_has_this_setting";
    json more = settings_;
    more[kNobodysKey] = 1;
    std::string said = "takes any setting: a misspelt one goes unnoticed";
    bool refused = false;
    try {
      ask_to_describe(more);
    } catch (const ConfigError& error) {
      refused = true;
      said = error.what();
    }
    judge(10, refused, "refuses a setting it does not know", said, Verdict::kAdvised);
    task_ = ask_to_describe(settings_);
  }

  /// What is not repeatable may be a robot: it moves when its user says so, by the user's policy.
  bool moves_unasked() {
    const bool repeatable = task_.description.repeatable;
    if (repeatable || (run_.moves && !run_.policy.empty())) return false;
    add(13, Verdict::kNotTried,
        "the task says that it is not repeatable: nothing is evaluated, for a robot might move "
        "(--move --policy FILE)");
    return true;
  }

  bool find_policies() {
    const int num_in = task_.description.input_dim;
    const int num_out = task_.description.output_dim;
    const SignalNames& signals = task_.description.signals;
    if (!run_.policy.empty()) {
      const Result<NamedPolicy> named = standard_policies().named_from_json(run_.policy);
      const bool fits =
          named && named->policy->input_dim() == num_in && named->policy->output_dim() == num_out;
      if (!fits) {
        throw ConfigError(kPolicyOption, "",
                          fmt::format("must be a policy of {} inputs and {} outputs{}", num_in,
                                      num_out, named ? "" : ": " + named.error().message));
      }
      if (const auto other = difference(named->signals, "those of the task are", signals)) {
        throw ConfigError(kPolicyOption, "", "its " + *other);
      }
      policy_ = to_json(*named->policy, signals);
      return true;
    }
    if (num_in + num_out > kSampleDimMax) {
      add(13, Verdict::kNotTried,
          fmt::format("no sample has {} inputs and {} outputs: give one (--policy)", num_in,
                      num_out));
      return false;
    }
    policy_ = to_json(*sample_policy(num_in, num_out, 3, .5), signals);
    other_policy_ = to_json(*sample_policy(num_in, num_out, 3, -.25), signals);
    long_policy_ = to_json(*sample_policy(num_in, num_out, kManyGaussians, .5), signals);
    return true;
  }

  std::chrono::milliseconds evaluation_limit() const {
    const std::chrono::duration<double> limit(2 * task_.description.time_limit_s + 1);
    return std::chrono::duration_cast<std::chrono::milliseconds>(limit);
  }
  /// An evaluation may take as long as at a worker: a robot's trial is not ended in its midst.
  template <typename Ask>
  auto within_limit(const Ask& ask) {
    program_->set_answer_limit(evaluation_limit());
    const pid_t pid = program_->process().pid();
    const Duration before = cpu_time_of_family(pid);
    try {
      auto answer = ask();
      longest_ = std::max(longest_, cpu_time_of_family(pid) - before);
      return answer;
    } catch (const ProgramEnded& ended) {
      if (ended.rule != kRuleOfAnswers) throw;
      throw ProgramEnded{
          ended.end, kRuleOfTime,
          fmt::format("{} (its time_limit_s is {})", ended.what, task_.description.time_limit_s)};
    }
  }
  Outcome ask_to_evaluate(const std::string& policy, std::uint64_t seed, std::int64_t rollout,
                          Trace* trace) {
    return program_
        ->evaluate({.run = 0, .rollout = rollout, .seed = seed, .policy = policy},
                   task_.description, trace)
        .outcome;
  }
  Outcome evaluate(const std::string& policy, std::uint64_t seed, std::int64_t rollout) {
    return within_limit([&] { return ask_to_evaluate(policy, seed, rollout, nullptr); });
  }
  /// What learning does not ask for, a trace or a policy of very many Gaussians, may take longer.
  Outcome evaluate_at_leisure(const std::string& policy, std::int64_t rollout, Trace* trace) {
    program_->set_answer_limit(
        std::max<std::chrono::milliseconds>(run_.answer_limit, evaluation_limit()));
    return ask_to_evaluate(policy, seed_, rollout, trace);
  }

  static std::string shown(const Outcome& outcome) {
    if (outcome.is_ok()) return fmt::format("reward {}", outcome.reward());
    return fmt::format("{}: {}", name(outcome.status()), outcome.reason());
  }
  /// A reason of ours begins so: what the program itself calls failed is its right.
  static bool is_answer(const Outcome& outcome) {
    return outcome.is_ok() || !outcome.reason().starts_with(kNoAnswer);
  }
  static bool has_failed(const Outcome& outcome) {
    return !outcome.is_ok() && !outcome.is_discarded();
  }

  /// To the bit.
  void judge_equal(int rule, const Outcome& found, const std::string& when,
                   Verdict otherwise = Verdict::kBroken) {
    if (!is_comparable_ || found.is_discarded()) {
      return add(rule, Verdict::kNotTried,
                 fmt::format("is not compared {}: {}", when,
                             found.is_discarded() ? "the trial was void, " + found.reason()
                                                  : "the same seed need not give the same reward"));
    }
    judge(rule, first_.agrees_with(found), "the same reward " + when,
          fmt::format("{} {}, and {} before", shown(found), when, shown(first_)), otherwise);
  }
  Verdict unless_noisy() const {
    return task_.description.deterministic ? Verdict::kBroken : Verdict::kAdvised;
  }

  void evaluate() {
    const bool has_reward = find_reward();
    if (!is_answer(first_)) return add(13, Verdict::kBroken, first_.reason());
    if (has_reward) {
      add(13, Verdict::kKept, "evaluates a policy: " + shown(first_));
    } else {
      add(13, Verdict::kUndecided,
          fmt::format("gives no policy a reward, so nothing is compared: {} (--policy FILE gives "
                      "one that the task can evaluate)",
                      shown(first_)));
    }
    program_->attend_for(kPatience);
    add(6, Verdict::kKept, "gives one answer and no more");
    if (has_reward) compare();
    end();
    if (has_reward) compare_with_another_process();
    judge(kRuleOfTime, to_seconds(longest_) <= task_.description.time_limit_s,
          fmt::format("evaluates within its time_limit_s, {} s", task_.description.time_limit_s),
          fmt::format("takes {:.2g} s of processor time, and its time_limit_s is {}: a worker ends "
                      "it",
                      to_seconds(longest_), task_.description.time_limit_s));
  }

  /// Outcomes that failed or are void are alike, whatever the program does.
  bool find_reward() {
    for (int trial = 0; trial < kTrialsMax; ++trial) {
      if (gives_reward(policy_)) return true;
      if (!is_answer(first_)) return false;
      if (!other_policy_.empty() && gives_reward(other_policy_)) {
        policy_.swap(other_policy_);
        return true;
      }
      if (has_failed(first_) && task_.description.deterministic) return false;
      ++seed_;
    }
    return false;
  }
  bool gives_reward(const std::string& policy) {
    first_ = evaluate(policy, seed_, 0);
    return first_.is_ok();
  }

  void compare() {
    const bool deterministic = task_.description.deterministic;
    if (!other_policy_.empty()) evaluate(other_policy_, seed_ + 1, 1);
    const Outcome again = evaluate(policy_, deterministic ? seed_ + 2 : seed_, 0);
    judge_equal(14, again,
                deterministic ? "with another seed, after another policy"
                              : "with the same seed, after another policy",
                unless_noisy());
    is_comparable_ = deterministic || first_.agrees_with(again);
    judge_equal(12, evaluate(policy_, seed_, 12345), "as another roll-out");
    large_seed();
    trace();
    more_keys();
    if (!long_policy_.empty()) long_line();
  }

  void compare_with_another_process() {
    start();
    ask_to_describe(settings_);
    judge_equal(14, evaluate(policy_, seed_, 0), "in another process", unless_noisy());
  }

  void large_seed() {
    const int num_trials = task_.description.deterministic ? 1 : kTrialsMax;
    Outcome found;
    try {
      found = first_good(kLargeSeed, num_trials);
    } catch (const ProgramEnded& ended) {
      throw ProgramEnded{ended.end, 12, fmt::format("with the seed {} {}", kLargeSeed, ended.what)};
    }
    const bool is_taken = !has_failed(found);
    judge(12, is_taken, fmt::format("takes the seed {}", kLargeSeed),
          fmt::format("does not take the seed {}: {}", kLargeSeed, shown(found)),
          is_taken || !fails_by_chance() ? Verdict::kBroken : Verdict::kAdvised);
  }
  /// That of the first of so many seeds that does not fail, else of the last.
  Outcome first_good(std::uint64_t seed, int num_seeds) {
    Outcome found;
    for (int i = 0; i < num_seeds; ++i) {
      found = evaluate(policy_, seed + static_cast<std::uint64_t>(i), 6);
      if (!has_failed(found)) break;
    }
    return found;
  }
  /// With small seeds too.
  bool fails_by_chance() {
    if (task_.description.deterministic) return false;
    for (int i = 0; i < kTrialsMax; ++i) {
      const auto seed = kSmallSeed + static_cast<std::uint64_t>(i);
      if (has_failed(evaluate(policy_, seed, 6))) return true;
    }
    return false;
  }

  void trace() {
    Trace trace;
    const Outcome traced = evaluate_at_leisure(policy_, 3, &trace);
    if (!is_answer(traced)) return add(16, Verdict::kBroken, traced.reason());
    if (!traced.is_discarded()) {
      judge(16, !trace.columns().empty(),
            fmt::format("records a trace of {} columns", trace.columns().size()),
            "records no trace: nothing can be shown of a roll-out", Verdict::kAdvised);
    }
    judge_equal(16, traced, "with a trace");
  }

  /// As a later version might ask.
  void more_keys() {
    json asked = json::parse(evaluate_line(0, 5, seed_, policy_, false));
    asked["evaluate"]["a_later_version"] = {{"may", "say more"}};
    const std::string line =
        within_limit([&] { return program_->ask_anything(asked.dump() + "\n"); });
    judge_equal(4, read_evaluate_answer(line, task_.description, nullptr).outcome,
                "with a key it does not know");
  }

  void long_line() {
    const Outcome found = evaluate_at_leisure(long_policy_, 4, nullptr);
    judge(2, is_answer(found), fmt::format("takes a line of {} bytes", long_policy_.size()),
          found.reason());
  }

  void end() {
    program_->process().close_input();
    bool ended = false;
    try {
      program_->attend_for(kEndLimit);
    } catch (const ProgramEnded&) {
      ended = true;
    }
    judge(20, ended, "ends when its standard input ends",
          "does not end when its standard input ends");
  }

  const ConformanceRun& run_;
  json settings_;
  std::optional<UserProgram> program_;
  DescribeAnswer task_;
  std::string policy_;
  std::string other_policy_;
  std::string long_policy_;
  std::uint64_t seed_ = 1;
  Outcome first_;  ///< of policy_ with seed_
  bool is_comparable_ = true;
  Duration longest_{};  ///< processor time of an evaluation
  std::vector<Finding> findings_;
};

}  // namespace

std::vector<Finding> check_evaluator(const ConformanceRun& run) { return Conformance(run).check(); }

}  // namespace treeroll::worker
