#include "learner/fit/recordings.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "learner/fit/relative_error.h"

namespace treeroll {
namespace {

/// Rows in no order would be recordings of two or three samples.
constexpr double kMeanLengthMin = 5;
/// Recordings are compared at so many times at most.
constexpr std::size_t kTimesMax = 1000;

/// One output of one recording.
struct Track {
  std::vector<double> times;  ///< not falling
  std::vector<double> outputs;
};

std::vector<Track> tracks_of(const Eigen::MatrixXd& data, Eigen::Index output_row) {
  std::vector<Track> tracks(1);
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    if (n > 0 && data(0, n) < data(0, n - 1)) tracks.emplace_back();
    if (std::isnan(data(output_row, n))) continue;
    tracks.back().times.push_back(data(0, n));
    tracks.back().outputs.push_back(data(output_row, n));
  }
  return tracks;
}

/// Times of samples, ascending, evenly many of all there are.
std::vector<double> times_to_compare(const std::vector<Track>& tracks) {
  std::vector<double> all;
  for (const Track& track : tracks) all.insert(all.end(), track.times.begin(), track.times.end());
  std::sort(all.begin(), all.end());
  const std::size_t stride = all.size() / kTimesMax + 1;
  std::vector<double> times;
  for (std::size_t i = 0; i < all.size(); i += stride) times.push_back(all[i]);
  return times;
}

/// A weighted mean and the squared distances from it, number by number.
struct Moments {
  double weight = 0;
  double mean = 0;
  double squares = 0;

  void add(double number, double of_weight) {
    weight += of_weight;
    const double apart = number - mean;
    mean += of_weight / weight * apart;
    squares += of_weight * apart * (number - mean);
  }
};

/// Adds what a recording gives at each of the times that it has.
void add_track(const Track& track, const std::vector<double>& times, std::vector<Moments>& at) {
  const double step = median_step(Eigen::Map<const Eigen::RowVectorXd>(
      track.times.data(), static_cast<Eigen::Index>(track.times.size())));
  if (!(step > 0)) return;
  const auto first = std::lower_bound(times.begin(), times.end(), track.times.front());
  std::size_t next = 0;  // the first sample that is not before the time
  for (auto i = static_cast<std::size_t>(first - times.begin());
       i < times.size() && times[i] <= track.times.back(); ++i) {
    while (track.times[next] < times[i]) ++next;
    if (track.times[next] == times[i]) {
      at[i].add(track.outputs[next], 1 / step);
      continue;
    }
    const double length = track.times[next] - track.times[next - 1];
    if (length > kGapSteps * step) continue;
    const double share = (times[i] - track.times[next - 1]) / length;
    at[i].add((1 - share) * track.outputs[next - 1] + share * track.outputs[next], 1 / step);
  }
}

/// Mean squared distance of recordings of an output from their mean.
double variance_between(const std::vector<Track>& tracks) {
  const std::vector<double> times = times_to_compare(tracks);
  std::vector<Moments> at(times.size());
  for (const Track& track : tracks) add_track(track, times, at);
  double squares = 0, weight = 0;
  for (const Moments& moments : at) {
    squares += moments.squares;
    weight += moments.weight;
  }
  return weight > 0 ? squares / weight : 0;
}

}  // namespace

double median_step(const Eigen::Ref<const Eigen::RowVectorXd>& times) {
  std::vector<double> steps;
  for (Eigen::Index n = 1; n < times.size(); ++n) {
    if (times[n] > times[n - 1]) steps.push_back(times[n] - times[n - 1]);
  }
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

double spread_of_recordings(const Eigen::MatrixXd& data, int input_dim) {
  if (input_dim != 1) return 0;
  const Eigen::MatrixXd outputs = data.bottomRows(data.rows() - 1);
  const Eigen::VectorXd unit = output_units(outputs);
  double sum = 0, count = 0;
  for (Eigen::Index o = 0; o < outputs.rows(); ++o) {
    const std::vector<Track> tracks = tracks_of(data, 1 + o);
    const auto num_seen = static_cast<double>(
        data.cols() - outputs.row(o).array().isNaN().template cast<Eigen::Index>().sum());
    count += num_seen;
    if (tracks.size() < 2 ||
        static_cast<double>(data.cols()) < kMeanLengthMin * static_cast<double>(tracks.size())) {
      continue;
    }
    sum += num_seen * variance_between(tracks) / (unit[o] * unit[o]);
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

}  // namespace treeroll
