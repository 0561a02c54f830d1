#include "learner/report/report_figures.h"

#include <fmt/format.h>

#include <iterator>
#include <stdexcept>
#include <utility>

#include "learner/report/figures/motion_plot.h"
#include "learner/report/figures/policy_plot.h"
#include "learner/report/figures/study_plots.h"
#include "learner/report/gnuplot.h"
#include "learner/report/learnt_policies.h"
#include "learner/report/noise_levels.h"
#include "learner/study/study_error.h"
#include "learner/study/study_file.h"

namespace treeroll::report {
namespace {

namespace fs = std::filesystem;

void append(std::vector<Plot> plots, Figures& figures) {
  std::move(plots.begin(), plots.end(), std::back_inserter(figures.plots));
}

NoiseLevels noise_of(const LoadedStudy& loaded, const StudyResults& results,
                     std::int64_t rollouts_max, std::vector<std::string>& remarks) {
  try {
    NoiseLevels noise = noise_levels(loaded.study, results, rollouts_max);
    if (noise.empty()) {
      remarks.push_back(fmt::format(
          "The growth of noise is not drawn: one repetition of all conditions has more than the {} "
          "roll-outs that are drawn again for it.",
          rollouts_max));
    }
    return noise;
  } catch (const std::runtime_error& error) {
    fmt::print(stderr, "the noise of {} is not drawn: {}\n", results.name, error.what());
    remarks.emplace_back("The growth of noise is not drawn: it does not follow from the results.");
    return {};
  }
}

/// What needs the study itself, not only its results.
void add_policies(const LoadedStudy& loaded, const StudyResults& results,
                  const WorkerProgram& worker_program, Figures& figures,
                  std::vector<PolicyTerms>& terms) {
  std::vector<LearntPolicy> policies = learnt_policies(loaded, results);
  std::vector<std::string> remarks = make_rollouts(loaded, worker_program, policies);
  std::move(remarks.begin(), remarks.end(), std::back_inserter(figures.left_out));
  terms = terms_of(policies);
  append(layer_plots(results.name, start_models(loaded, policies)), figures);
  append(policy_plots(results.name, policies), figures);
  append(path_plots(results.name, policies), figures);
  append(solution_plots(results.name, policies), figures);
  append(slice_plots(results.name, policies), figures);
  append(goal_plots(results.name, policies), figures);
  append(motion_plots(results.name, policies), figures);
}

Figures figures_of(const StudyResults& results, const WorkerProgram& worker_program,
                   std::int64_t noise_rollouts_max, std::vector<PolicyTerms>& terms) {
  try {
    const LoadedStudy loaded = load_resolved_study(results.directory / "study.toml");
    std::vector<std::string> remarks;
    Figures figures = study_plots(results, noise_of(loaded, results, noise_rollouts_max, remarks));
    std::move(remarks.begin(), remarks.end(), std::back_inserter(figures.left_out));
    add_policies(loaded, results, worker_program, figures, terms);
    return figures;
  } catch (const StudyError& error) {
    // A demonstration that has been moved away, say: the results stand without it.
    fmt::print(stderr, "policies of {} are not drawn: {}\n", results.name, error.what());
    Figures figures = study_plots(results);
    figures.left_out.emplace_back(
        "Policies, their motion and the growth of noise are not drawn: the study cannot be "
        "loaded.");
    return figures;
  }
}

}  // namespace

StudyPictures draw_study(const StudyResults& results, const fs::path& output,
                         const WorkerProgram& worker_program, std::int64_t noise_rollouts_max) {
  const std::string place = "figures/" + to_id(results.name);
  fs::create_directories(output / place);
  StudyPictures drawn;
  Figures figures = figures_of(results, worker_program, noise_rollouts_max, drawn.terms);
  drawn.remarks = std::move(figures.left_out);
  for (const Plot& plot : figures.plots) {
    Picture picture = draw(plot, output / place, place);
    picture.id = to_id(results.name + "-" + picture.id);
    drawn.pictures.push_back(std::move(picture));
  }
  return drawn;
}

}  // namespace treeroll::report
