#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "sim/cart_pendulum.h"
#include "sim/plant_settings.h"
#include "workers/tasks/task.h"

namespace treeroll {

/// How much plants and starts differ from one evaluation to the next.
struct PlantVariation {
  int evaluations = 1;             ///< a reward is the mean of so many
  double parameter_fraction = 0;   ///< lengths, masses and inertias are uniform within +- this
                                   ///< share of their values, each on its own
  double start_deviation_rad = 0;  ///< standard deviation of both angles at the start

  bool is_none() const { return parameter_fraction == 0 && start_deviation_rad == 0; }
};

/// Reads the table `variation` of a task:
///
///   variation = {evaluations = 10, parameter_fraction = .02, start_deviation_rad = .02}
///
/// Throws ConfigError, also for several evaluations of which each is like the other.
PlantVariation read_plant_variation(SettingsReader& settings);

/// The plant and the start of one evaluation, a pure function of seed and number.
sim::DoublePendulum varied(const sim::DoublePendulum& pendulum, const PlantVariation& variation,
                           std::uint64_t seed, int evaluation);
sim::CartPendulumState varied(const sim::CartPendulumState& start, const PlantVariation& variation,
                              std::uint64_t seed, int evaluation);

/// A plant that is another one at each evaluation; without variation always the same.
class VariedPlant {
 public:
  VariedPlant(const sim::PlantSettings& plant, const PlantVariation& variation);

  /// The plant as the settings have it, of which those of the evaluations are variations.
  sim::CartPendulumPlant& plant() { return *plant_; }
  const sim::CartPendulumPlant& plant() const { return *plant_; }
  const sim::PlantSettings& settings() const { return settings_; }

  /// Whether the same policy gets the same reward whatever the seed.
  bool deterministic() const { return variation_.is_none(); }

  /// Mean reward over the evaluations; the first that does not end well decides.
  Outcome evaluate(std::uint64_t seed, const sim::CartPendulumState& start,
                   const std::function<Outcome(sim::CartPendulumPlant& plant,
                                               const sim::CartPendulumState& start)>& once);

 private:
  sim::PlantSettings settings_;
  PlantVariation variation_;
  std::unique_ptr<sim::CartPendulumPlant> plant_;
};

}  // namespace treeroll
