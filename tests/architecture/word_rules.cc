#include <regex>

#include "tests/architecture/rooms.h"
#include "tests/architecture/rules.h"

namespace treeroll::architecture {
namespace {

struct WordRule {
  std::regex word;
  std::string instead;
};

const std::vector<WordRule>& core_rules() {
  static const std::vector<WordRule> rules = {
      {std::regex(R"(\b(system|steady|high_resolution|utc|file)_clock\b|\bclock_gettime\b|)"
                  R"(\bgettimeofday\b|\btimespec_get\b|\bstd::(time|clock)\s*\(|)"
                  R"(\btime\s*\(\s*(nullptr|NULL)\s*\))"),
       "a clock in a core: take the time as an argument, TimePoint of common/base/time.h"},
      {std::regex(R"(\bstd::(j?thread|async|(\w+_)?mutex|condition_variable(_any)?|future|promise|)"
                  R"(atomic(_\w+)?|latch|barrier|execution)\b|\bpthread_\w+|\bthread_local\b|)"
                  R"(#\s*pragma\s+omp\b)"),
       "threads in a core: one thread a daemon; parallelism is worker processes"},
  };
  return rules;
}

/// For cores and portable rooms: outcomes that are no function of the study.
const std::vector<WordRule>& repeatable_rules() {
  static const std::vector<WordRule> rules = {
      {std::regex(R"(\b(random_device|mt19937(_64)?|minstd_rand0?|default_random_engine|srand|)"
                  R"(rand_r|drand48|getrandom|getentropy|randombytes_\w+)\b|\brand\s*\()"),
       "a random source: use RandomStream of common/numbers/random_stream.h, keyed by seed, "
       "repetition and roll-out"},
      {std::regex(R"(\bstd::\w+_distribution\b|\bnormal_distribution\b|)"
                  R"(\bstd::(ranges::)?(shuffle|sample)\b)"),
       "implementation-defined draws: use RandomStream of common/numbers/random_stream.h"},
      {std::regex(R"(\bunordered_(multi)?(map|set)\b|\bstd::hash\b)"),
       "an order that differs between libraries: use std::map or std::set, content_hash for names"},
  };
  return rules;
}

/// Eigen's own exp() and log() end in glibc's for what does not fill a vector register.
const std::vector<WordRule>& portable_rules() {
  static const std::vector<WordRule> rules = {
      {std::regex(R"((\bstd::|(^|[^:\w.>]))(a?(sin|cos|tan)h?|atan2|exp2?|expm1|log(2|10|1p)?|pow|)"
                  R"(cbrt|hypot|[tl]gamma|erfc?)\s*\(|\.(exp|log|sin|cos|tan|tanh)\s*\(\s*\))"),
       "the last bits of the C library's elementary functions differ between processors: use "
       "common/numbers/elementary.h (and add to it what it lacks)"},
  };
  return rules;
}

void apply(const std::vector<WordRule>& rules, const SourceFile& file,
           std::vector<Finding>& findings) {
  for (std::size_t i = 0; i < file.code.size(); ++i) {
    if (file.code[i].find_first_not_of(' ') == std::string::npos) continue;
    for (const WordRule& rule : rules) {
      std::smatch match;
      if (!std::regex_search(file.code[i], match, rule.word)) continue;
      findings.push_back(
          {file.path, static_cast<int>(i) + 1, "'" + match.str() + "': " + rule.instead});
    }
  }
}

}  // namespace

std::vector<Finding> check_words(const SourceFile& file) {
  std::vector<Finding> findings;
  const std::string room = room_of(file.path);
  if (room.empty()) return findings;
  const Room& rules = rooms().at(room);
  if (rules.is_core) apply(core_rules(), file, findings);
  if (rules.is_core || rules.is_portable) apply(repeatable_rules(), file, findings);
  const bool declares_them = file.path.starts_with("common/numbers/elementary");
  if (rules.is_portable && !declares_them) apply(portable_rules(), file, findings);
  return findings;
}

}  // namespace treeroll::architecture
