#include <fmt/format.h>

#include <algorithm>

#include "learner/report/figures/study_plots.h"
#include "learner/report/statistics/sample.h"
#include "learner/results/run_counts.h"
#include "learner/results/statistics.h"

namespace treeroll::report {

Plot switch_boxes(const StudyResults& study) {
  Plot plot{.id = "switches", .title = "Switches of layer in " + study.name};
  std::string boxes = "# row lower_quartile median upper_quartile least most runs\n";
  std::string points = "# rollout row\n";
  std::string labels;
  int num_rows = 0;
  for (const std::string& condition : conditions_of(study)) {
    const auto runs = runs_of(study, condition);
    std::vector<double> first;
    for (const MeasuredRun& run : runs) {
      if (!run->switches.empty()) first.push_back(rollouts_before_switch(*run));
    }
    if (first.empty()) continue;
    ++num_rows;
    const Quartiles box = *quartiles(first);
    const auto [least, most] = std::minmax_element(first.begin(), first.end());
    boxes += fmt::format("{} {} {} {} {} {} {}\n", -num_rows, datum(box.low), datum(box.median),
                         datum(box.high), datum(*least), datum(*most), first.size());
    for (const double rollout : first) points += fmt::format("{} {}\n", rollout, -num_rows);
    labels += fmt::format(
        "{}{} {}", num_rows == 1 ? "" : ", ",
        literal(fmt::format("{} ({} of {})", condition, first.size(), runs.size())), -num_rows);
  }
  if (num_rows == 0) return {};
  plot.data = boxes + "\n\n" + points + "\n\n";
  plot.commands = fmt::format(
      "  unset key\n  set xlabel 'roll-outs before the first switch'\n"
      "  set ytics ({})\n  set yrange [{}:-.4]; set xrange [0:*]\n"
      "  plot data index 0 using 5:1:($6-$5):(0) with vectors nohead lc rgb '#000000' lw 1 dt 1, "
      "data index 0 using 2:1:2:4:($1-.3):($1+.3) with boxxyerror fs solid 1 fc rgb '#9ecae1' "
      "lc rgb '#000000' lw 1 dt 1, "
      "data index 0 using 3:($1-.3):(0):(.6) with vectors nohead lc rgb '#000000' lw 3 dt 1, "
      "data index 1 using 1:2 with points pt 6 ps .5 lc rgb '#D55E00'\n",
      labels, -num_rows - .6);
  plot.width_px = 960;
  plot.height_px = 110 + 26 * num_rows;
  plot.caption =
      "Boxes from the lower to the upper quartile with the median, lines from the least to the "
      "most, circles the runs. In brackets the runs that switched, of all; the others are not "
      "drawn. Conditions without a switch are left out.";
  return plot;
}

}  // namespace treeroll::report
