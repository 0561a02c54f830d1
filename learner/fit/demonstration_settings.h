#pragma once

#include <Eigen/Core>
#include <string>

#include "learner/fit/csv_demonstration.h"

namespace treeroll {

class SettingsReader;

/// Data to fit a policy to, and what suits their units.
struct Demonstration {
  Eigen::MatrixXd data;            ///< d x N, inputs over outputs, columns are observations; an
                                   ///< output that is missing is NaN (missing_outputs.h)
  std::string text;                ///< CsvDemonstration::text of files, else empty
  int input_dim = 1;               ///< dI
  Eigen::VectorXd regularisation;  ///< d x 1, variances a fit adds by default
  double output_deviation = 5;     ///< of the components EM starts from by default; 0: none suits
  Alignment alignment = Alignment::kNone;  ///< CsvDemonstration::alignment

  /// Whether the numbers of an output, counted from 0, are not all the same.
  bool output_varies(Eigen::Index output) const;
};

/// Reads [policy.demonstration], of one of two kinds:
///
///   kind = "cart_acceleration"   # (4-5): time in s -> acceleration of the cart in m/s^2
///   duration_s = 2.2
///   samples = 200
///   p = [-0.106, -0.185, 0.092, 0.134]
///
///   kind = "csv"                 # csv_demonstration.h says what a file holds
///   files = ["first.csv"]        # several are set beside each other
///   align = "none"               # of several files: or "duration", "dynamic_time_warping"
///                                # (alignment.h); the content is what comes of it
///   inputs = ["t"]               # names of columns
///   outputs = ["x", "y"]
///   missing_outputs = false      # true: an observation may lack outputs, whose fields are empty
///   content = "5d..."            # the data's: refused where the files have changed; or instead of
///                                # files, where the sources know the data by it
///
/// By default the regularisation of files is 1e-4 of each column's variance, and the deviation of
/// the outputs that of the most varied of them. An output may be constant: then both are 0, and a
/// fit needs a regularisation of its own for it. Throws ConfigError. Calls finish().
Demonstration read_demonstration(SettingsReader reader, const StartSources& sources);

}  // namespace treeroll
