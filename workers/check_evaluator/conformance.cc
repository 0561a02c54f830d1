#include "workers/check_evaluator/conformance.h"

#include <fmt/format.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "common/base/config_error.h"
#include "common/policy/kinds/standard_policies.h"
#include "workers/check_evaluator/sample_policy.h"
#include "workers/tasks/trace.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;
using Verdict = Finding::Verdict;

constexpr const char* kPolicyOption = "--policy";
/// A text longer than a pipe holds.
constexpr int kManyGaussians = 1500;
/// Half of those that a study draws are above the integers of 64 bits with a sign.
constexpr std::uint64_t kLargeSeed = 0xF123'4567'89AB'CDEF;
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

  void start() {
    program_.emplace(run_.program, run_.log);
    program_->set_answer_limit(run_.answer_limit);
  }

  bool describe() {
    try {
      task_ = program_->describe(run_.task, settings_);
    } catch (const ConfigError& error) {
      add(8, Verdict::kBroken, error.what());
      return false;
    }
    add(8, Verdict::kKept,
        fmt::format("describes its task: {} inputs, {} outputs, rewards {} .. {}",
                    task_.description.input_dim, task_.description.output_dim,
                    task_.description.reward_min, task_.description.reward_max));
    const json resolved = task_.settings ? json::parse(*task_.settings) : settings_;
    const DescribeAnswer again = program_->describe(run_.task, resolved);
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
      program_->describe(run_.task, more);
    } catch (const ConfigError& error) {
      refused = true;
      said = error.what();
    }
    judge(10, refused, "refuses a setting it does not know", said, Verdict::kAdvised);
    task_ = program_->describe(run_.task, settings_);
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

  EvaluateAnswer evaluate(const std::string& policy, std::uint64_t seed, std::int64_t rollout,
                          Trace* trace = nullptr) {
    return program_->evaluate({.run = 0, .rollout = rollout, .seed = seed, .policy = policy},
                              task_.description, trace);
  }

  /// To the bit, except that what a person decides says nothing.
  static bool agree(const Outcome& one, const Outcome& other) {
    return one.is_discarded() || other.is_discarded() || one.agrees_with(other);
  }
  static std::string shown(const Outcome& outcome) {
    if (outcome.is_ok()) return fmt::format("reward {}", outcome.reward());
    return fmt::format("{}: {}", name(outcome.status()), outcome.reason());
  }
  void judge_equal(int rule, const Outcome& found, const std::string& when,
                   Verdict otherwise = Verdict::kBroken) {
    judge(rule, agree(first_, found), "the same reward " + when,
          fmt::format("{} {}, and {} before", shown(found), when, shown(first_)), otherwise);
  }

  void evaluate() {
    first_ = evaluate(policy_, 1, 0).outcome;
    // A reason of ours begins so: what the program itself calls failed is its right.
    const bool is_answer = first_.is_ok() || !first_.reason().starts_with(kNoAnswer);
    judge(13, is_answer, "evaluates a policy: " + shown(first_), first_.reason());
    if (!is_answer) return;
    program_->attend_for(kPatience);
    add(6, Verdict::kKept, "gives one answer and no more");

    const bool deterministic = task_.description.deterministic;
    judge_equal(12, evaluate(policy_, 1, 12345).outcome, "as another roll-out");
    if (!other_policy_.empty()) evaluate(other_policy_, 2, 1);
    judge_equal(14, evaluate(policy_, deterministic ? 3 : 1, 2).outcome,
                deterministic ? "with another seed, after another policy"
                              : "with the same seed, after another policy",
                deterministic ? Verdict::kBroken : Verdict::kAdvised);
    large_seed();
    trace();
    more_keys();
    if (!long_policy_.empty()) {
      evaluate(long_policy_, 1, 4);
      add(2, Verdict::kKept, fmt::format("takes a line of {} bytes", long_policy_.size()));
    }
    end();
    start();
    program_->describe(run_.task, settings_);
    judge_equal(14, evaluate(policy_, 1, 0).outcome, "in another process",
                deterministic ? Verdict::kBroken : Verdict::kAdvised);
  }

  void large_seed() {
    Outcome found;
    try {
      found = evaluate(policy_, kLargeSeed, 6).outcome;
    } catch (const ProgramEnded& ended) {
      throw ProgramEnded{ended.end, 12, fmt::format("with the seed {} {}", kLargeSeed, ended.what)};
    }
    // A trial of a noisy task may fail by chance.
    judge(12, found.is_ok() || found.is_discarded() || !first_.is_ok(),
          fmt::format("takes the seed {}", kLargeSeed),
          fmt::format("does not take the seed {}: {}", kLargeSeed, shown(found)),
          task_.description.deterministic ? Verdict::kBroken : Verdict::kAdvised);
  }

  void trace() {
    Trace trace;
    const Outcome traced = evaluate(policy_, 1, 3, &trace).outcome;
    if (!traced.is_ok() && traced.reason().starts_with(kNoAnswer)) {
      return add(16, Verdict::kBroken, traced.reason());
    }
    judge(16, !trace.columns().empty(),
          fmt::format("records a trace of {} columns", trace.columns().size()),
          "records no trace: nothing can be shown of a roll-out", Verdict::kAdvised);
    judge_equal(16, traced, "with a trace");
  }

  /// As a later version might ask.
  void more_keys() {
    json asked = json::parse(evaluate_line(0, 5, 1, policy_, false));
    asked["evaluate"]["a_later_version"] = {{"may", "say more"}};
    const std::string line = program_->ask_anything(asked.dump() + "\n");
    judge_equal(4, read_evaluate_answer(line, task_.description, nullptr).outcome,
                "with a key it does not know");
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
  Outcome first_;
  std::vector<Finding> findings_;
};

}  // namespace

std::vector<Finding> check_evaluator(const ConformanceRun& run) { return Conformance(run).check(); }

}  // namespace treeroll::worker
