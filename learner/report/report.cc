#include "learner/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <map>
#include <stdexcept>
#include <variant>

#include "common/base/config_error.h"
#include "common/base/shown_reward.h"
#include "common/files/atomic_file.h"
#include "common/program/standard_output.h"
#include "learner/core/learner_core.h"
#include "learner/journal/journal_file.h"
#include "learner/journal/journal_origins.h"
#include "learner/report/claims_file.h"
#include "learner/report/report_figures.h"
#include "learner/report/report_sections.h"
#include "learner/report/state_results.h"
#include "learner/results/recheck_text.h"
#include "learner/results/state_directory.h"
#include "learner/results/summary.h"
#include "learner/state/state_study.h"
#include "learner/study/study_error.h"
#include "learner/study/study_file.h"

namespace treeroll::report {
namespace {

namespace fs = std::filesystem;

/// Roll-outs that are drawn again for the growth of noise, of all studies: some seconds.
constexpr std::int64_t kNoiseRolloutsMax = 400'000;

/// What is asked for must be there before anything is read or drawn.
void check(const ReportOptions& options) {
  for (const fs::path& directory : options.directories) {
    const bool has_journal = fs::is_regular_file(journal_of(directory));
    for (const char* file : {"study.toml", "runs.csv", "rollouts.csv"}) {
      const bool is_needed = !has_journal || file == study_of(directory).filename();
      if (!is_needed || fs::is_regular_file(directory / file)) continue;
      throw ConfigError("DIR", directory.string(),
                        fmt::format("must be the state directory of a study: it has no {}", file));
    }
  }
  if (options.needs_worker_program) check_executable(options.worker_program);
}

/// Two studies of one name, of two seeds say, are told apart by their place on the command line.
std::vector<StudyResults> read_studies(const std::vector<fs::path>& directories) {
  std::vector<StudyResults> studies;
  std::map<std::string, int> counts;
  for (const fs::path& directory : directories) {
    StudyResults study = read_state_results(directory);
    if (!study.missing.empty()) {
      fmt::print(stderr, "{} is not complete: {}: treeroll-learner --resume {} goes on\n",
                 study.name, study.missing, directory.string());
    }
    if (const int count = ++counts[study.name]; count > 1) {
      study.name += fmt::format(" ({})", count);
    }
    studies.push_back(std::move(study));
  }
  return studies;
}

/// Under what the conditions began with: the study holds it, no table does. Only where a claim
/// asks.
void add_log_likelihoods(const std::vector<Claim>& claims, std::vector<StudyResults>& studies) {
  for (StudyResults& results : studies) {
    const bool is_asked = std::any_of(claims.begin(), claims.end(), [&](const Claim& claim) {
      return needs_log_likelihoods(claim, results.name);
    });
    if (!is_asked) continue;
    try {
      const LoadedStudy loaded = load_resolved_study(results.directory / "study.toml");
      for (std::size_t i = 0; i < loaded.study.conditions.size(); ++i) {
        const std::vector<double>& by_layer = loaded.log_likelihoods[i];
        if (by_layer.empty()) continue;
        results.log_likelihoods[loaded.study.conditions[i].name] = by_layer.back();
      }
    } catch (const StudyError& error) {
      // A demonstration that has been moved away: the claim is not measured, the others stand.
      fmt::print(stderr, "fits of {} are not judged: {}\n", results.name, error.what());
    }
  }
}

/// Results of workers of several numeric classes are worth a word, and roll-outs that were run
/// again on another worker. A study without a journal says nothing of them.
void remark_journal(const StudyResults& study, std::vector<std::string>& said) {
  const fs::path journal = journal_of(study.directory);
  if (!fs::is_regular_file(journal)) return;
  JournalOrigins origins;
  bool has_second_answers = false;
  const Result<JournalTail> tail = read_journal(journal, [&](const JournalRecord& record) {
    origins.add(record);
    has_second_answers = has_second_answers || std::holds_alternative<SecondAnswer>(record);
  });
  if (!tail) {
    fmt::print(stderr, "{}\n", tail.error().message);
    said.emplace_back("On what the roll-outs were computed is not known: the journal is damaged.");
    return;
  }
  if (origins.results_by_class().size() > 1) {
    said.push_back(
        fmt::format("The roll-outs were computed by workers of several numeric classes: {}. The "
                    "bits of the results depend on who computed which.",
                    class_list(origins.results_by_class())));
  }
  if (!has_second_answers) return;
  try {
    // Learnt anew: which answers count after an extension follows from what was learnt.
    const StateFiles files{study.directory, journal};
    const StateStudy state = read_state_study(files);
    learner::LearnerCore core(state.loaded.study, learner::LearnerSettings{});
    fold_state(files, state, TimePoint{}, core);
    for (std::string& remark : remarks(core.workforce().rechecks().record()))
      said.push_back(std::move(remark) + ".");
  } catch (const std::runtime_error& error) {
    fmt::print(stderr, "roll-outs that were run again are not told of: {}\n", error.what());
  }
}

struct Chosen {
  const StudyResults* study;
  std::string condition;
};

/// CONDITION or STUDY:CONDITION of the command line.
Chosen choose(const std::vector<StudyResults>& studies, const std::string& argument) {
  std::vector<Chosen> found;
  for (const StudyResults& study : studies) {
    for (const std::string& condition : conditions_of(study)) {
      if (argument == condition || argument == study.name + ":" + condition) {
        found.push_back({&study, condition});
      }
    }
  }
  if (found.size() == 1) return found.front();
  throw ConfigError("--compare", argument,
                    found.empty() ? "no study given has this condition"
                                  : "several studies have this condition: write STUDY:CONDITION");
}

/// @param remarks  sentences on what is left out of them
std::vector<Comparison> comparisons(const ReportOptions& options,
                                    const std::vector<StudyResults>& studies,
                                    std::vector<std::string>& remarks) {
  if (!options.compare.empty()) {
    const Chosen a = choose(studies, options.compare.at(0));
    const Chosen b = choose(studies, options.compare.at(1));
    return {compare(a.study->name + ":" + a.condition, runs_of(*a.study, a.condition),
                    b.study->name + ":" + b.condition, runs_of(*b.study, b.condition),
                    a.study == b.study)};
  }
  if (!options.claims_file.empty()) return {};
  if (studies.size() == 2) return comparisons_between(studies[0], studies[1]);
  std::vector<Comparison> all;
  for (const StudyResults& study : studies) {
    for (Comparison& comparison : comparisons_within(study)) {
      if (studies.size() > 1) {
        comparison.a = study.name + ":" + comparison.a;
        comparison.b = study.name + ":" + comparison.b;
      }
      all.push_back(std::move(comparison));
    }
    if (std::string remark = pairs_left_out(study); !remark.empty()) {
      remarks.push_back(std::move(remark));
    }
  }
  return all;
}

void print_claims(const std::vector<Claim>& claims, const std::vector<ClaimResult>& results) {
  std::map<Verdict, int> counts;
  for (std::size_t i = 0; i < claims.size(); ++i) {
    ++counts[results[i].verdict];
    fmt::print("{:<14} {:<6} {}\n", name(results[i].verdict), claims[i].section, claims[i].text);
  }
  fmt::print("{} claims: {} hold, {} do not, {} inconclusive, {} not measured\n", claims.size(),
             counts[Verdict::kHolds], counts[Verdict::kFails], counts[Verdict::kInconclusive],
             counts[Verdict::kNotMeasured]);
}

void print_comparisons(const std::vector<Comparison>& comparisons) {
  for (const Comparison& comparison : comparisons) {
    if (!comparison.end) continue;
    const TestResult& end = *comparison.end;
    fmt::print("{} - {}: {}{} {} near the end, p {:.2g}\n", comparison.a, comparison.b,
               end.difference > 0 ? "+" : "", shown_reward(end.difference),
               shown_interval(end.interval_95), end.p);
  }
}

}  // namespace

void write_report(const ReportOptions& options) {
  check(options);
  const std::vector<Claim> claims =
      options.claims_file.empty() ? std::vector<Claim>{} : read_claims(options.claims_file);
  std::vector<StudyResults> studies = read_studies(options.directories);
  add_log_likelihoods(claims, studies);
  std::vector<ClaimResult> results;
  for (const Claim& claim : claims) results.push_back(judge(claim, studies));
  std::vector<std::string> comparison_remarks;
  const std::vector<Comparison> compared = comparisons(options, studies, comparison_remarks);

  Document document{.title = "Report", .sections = {}};
  std::vector<StudyPictures> figures;
  for (const StudyResults& study : studies) {
    figures.push_back(draw_study(study, options.output, options.worker_program,
                                 kNoiseRolloutsMax / static_cast<std::int64_t>(studies.size())));
    remark_journal(study, figures.back().remarks);
  }
  if (!claims.empty()) {
    std::vector<Picture> all;
    for (const StudyPictures& of_study : figures) {
      all.insert(all.end(), of_study.pictures.begin(), of_study.pictures.end());
    }
    document.sections.push_back(claims_section(claims, results, all));
  }
  if (!compared.empty()) {
    document.sections.push_back(comparison_section("Comparisons", compared, comparison_remarks));
  }
  for (std::size_t i = 0; i < studies.size(); ++i) {
    document.sections.push_back(
        study_section(studies[i], figures[i].pictures, figures[i].remarks, figures[i].terms));
  }

  write_atomically(options.output / "report.html", to_html(document));
  write_atomically(options.output / "report.md", to_markdown(document));
  std::vector<std::vector<PolicyTerms>> terms;
  for (const StudyPictures& of_study : figures) terms.push_back(of_study.terms);
  write_atomically(options.output / "report.json",
                   report_json(claims, results, studies, compared, terms));
  if (!claims.empty()) print_claims(claims, results);
  print_comparisons(compared);
  fmt::print("{}\n", (options.output / "report.html").string());
  flush_standard_output();
}

}  // namespace treeroll::report
