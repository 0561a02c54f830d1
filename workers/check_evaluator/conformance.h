#pragma once

#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "workers/user_program/user_program.h"

namespace treeroll::worker {

/// What is found of one rule of workers/user_program/EVALUATOR.md.
struct Finding {
  enum class Verdict {
    kKept,
    kBroken,     ///< a MUST: a worker will not take it, or rewards will be wrong
    kAdvised,    ///< a SHOULD that is not kept
    kNotTried,   ///< what it takes is missing
    kUndecided,  ///< no policy got a reward: what keeps the rules and what does not look alike
  };
  int rule = 0;
  Verdict verdict = Verdict::kKept;
  std::string what;  ///< for a person
};

struct ConformanceRun {
  ProgramSettings program;
  std::string task = "task";    ///< the name it is asked for
  std::string settings = "{}";  ///< a JSON object
  std::string policy;           ///< text of one to evaluate; empty: samples are made
  bool moves = false;           ///< evaluates also what is not repeatable, the policy above
  /// Of a description. That of an evaluation follows from the task's time_limit_s.
  std::chrono::seconds answer_limit;
  UserProgram::Log log;
};

/// Puts a program through the rules, in processes of its own. Stops early where nothing further can
/// be tried; the last finding then says why.
std::vector<Finding> check_evaluator(const ConformanceRun& run);

}  // namespace treeroll::worker
