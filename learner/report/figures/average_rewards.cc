#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "learner/report/figures/study_plots.h"
#include "learner/report/statistics/sample.h"
#include "learner/results/statistics.h"

namespace treeroll::report {

Plot average_rewards(const StudyResults& study) {
  Plot plot{.id = "average_rewards", .title = "Mean reward over all roll-outs of " + study.name};
  std::string means = "# row mean low high runs\n";
  std::string points = "# reward row\n";
  std::string labels;
  int num_rows = 0;
  std::vector<double> all;
  for (const std::string& condition : conditions_of(study)) {
    ++num_rows;
    std::vector<double> rewards;  // by run
    for (const MeasuredRun& run : runs_of(study, condition)) {
      if (const auto reward = measure(run, {.kind = MeasureKind::kMean})) {
        rewards.push_back(*reward);
      }
    }
    all.insert(all.end(), rewards.begin(), rewards.end());
    const double none = std::numeric_limits<double>::quiet_NaN();
    const auto interval = mean_interval_95(rewards);
    means += fmt::format("{} {} {} {} {}\n", -num_rows, datum(mean(rewards).value_or(none)),
                         datum(interval ? interval->low : none),
                         datum(interval ? interval->high : none), rewards.size());
    for (const double reward : rewards) points += fmt::format("{} {}\n", reward, -num_rows);
    labels += fmt::format("{}{} {}", num_rows == 1 ? "" : ", ",
                          literal(fmt::format("{} ({})", condition, rewards.size())), -num_rows);
  }
  if (all.empty()) return {};
  // gnuplot widens a range without a width around 0, where no reward is.
  const bool is_one = std::ranges::max(all) == std::ranges::min(all);
  const std::string range = is_one ? fmt::format("[0:{}]", std::max(1., 2 * all.front())) : "[*:*]";
  // A set without a point would not be counted.
  plot.data = means + "\n\n" + points + "NaN NaN\n\n\n";
  plot.commands = fmt::format(
      "  unset key\n  set xlabel 'mean reward over all roll-outs'\n"
      "  set ytics ({})\n  set yrange [{}:-.4]; set xrange {}\n"
      "  plot data index 0 using 3:1:($4-$3):(0) with vectors nohead lc rgb '#9ecae1' lw 10 dt 1, "
      "data index 1 using 1:2 with points pt 6 ps .5 lc rgb '#D55E00', "
      "data index 0 using 2:($1-.3):(0):(.6) with vectors nohead lc rgb '#000000' lw 3 dt 1\n",
      labels, -num_rows - .6, range);
  plot.width_px = 960;
  plot.height_px = 110 + 26 * num_rows;
  plot.caption =
      "Mean over the roll-outs of a run, perturbed as they were: circles are the runs, whose "
      "number "
      "stands in brackets, the black mark is their mean, the bar its 95 % interval. A run that was "
      "stopped has the mean over the roll-outs that it has." +
      caption_of_runs_that_go_on(study);
  return plot;
}

}  // namespace treeroll::report
