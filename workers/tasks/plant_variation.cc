#include "workers/tasks/plant_variation.h"

#include "common/numbers/random_stream.h"
#include "common/settings/settings_reader.h"

namespace treeroll {
namespace {

constexpr std::int64_t kEvaluationsMax = 1000;
/// Below 1, so that nothing loses its mass.
constexpr NumberRule kFraction{.min = 0, .max = .9};
constexpr NumberRule kDeviation{.min = 0, .max = 10};

/// Numbers of one evaluation: those of the plant and those of the start do not depend on whether
/// the others are drawn.
RandomStream stream(std::uint64_t seed, int evaluation, std::uint32_t what) {
  return {seed, what, static_cast<std::uint32_t>(evaluation), RandomPurpose::kTaskSeed};
}

}  // namespace

PlantVariation read_plant_variation(SettingsReader& settings) {
  SettingsReader table = settings.table("variation");
  PlantVariation variation;
  variation.evaluations =
      static_cast<int>(table.integer("evaluations", 1, kEvaluationsMax, 1,
                                     {.meaning = "A reward is the mean of so many evaluations, "
                                                 "each on a plant and from a start of its own"}));
  variation.parameter_fraction =
      table.number("parameter_fraction", kFraction, 0,
                   {.meaning = "Lengths, masses and inertias are uniform within this share of "
                               "their values, up and down"});
  variation.start_deviation_rad =
      table.number("start_deviation_rad", kDeviation, 0,
                   {.meaning = "Standard deviation of both angles at the start", .unit = "rad"});
  table.finish();
  if (variation.is_none() && variation.evaluations > 1) {
    table.refuse("evaluations",
                 "must be 1 where neither parameter_fraction nor "
                 "start_deviation_rad makes one differ from the other");
  }
  return variation;
}

sim::DoublePendulum varied(const sim::DoublePendulum& pendulum, const PlantVariation& variation,
                           std::uint64_t seed, int evaluation) {
  RandomStream random = stream(seed, evaluation, 1);
  sim::DoublePendulum p = pendulum;
  for (double* number : {&p.l1, &p.l2, &p.a1, &p.a2, &p.m1, &p.m2, &p.j1, &p.j2}) {
    *number *= 1 + variation.parameter_fraction * (2 * random.next_uniform() - 1);
  }
  return p;
}

sim::CartPendulumState varied(const sim::CartPendulumState& start, const PlantVariation& variation,
                              std::uint64_t seed, int evaluation) {
  RandomStream random = stream(seed, evaluation, 2);
  sim::CartPendulumState state = start;
  state.phi1 += variation.start_deviation_rad * random.next_normal();
  state.phi2 += variation.start_deviation_rad * random.next_normal();
  return state;
}

VariedPlant::VariedPlant(const sim::PlantSettings& plant, const PlantVariation& variation)
    : settings_(plant), variation_(variation), plant_(sim::make_plant(plant)) {}

Outcome VariedPlant::evaluate(
    std::uint64_t seed, const sim::CartPendulumState& start,
    const std::function<Outcome(sim::CartPendulumPlant&, const sim::CartPendulumState&)>& once) {
  if (variation_.is_none()) return once(*plant_, start);
  double sum = 0;
  for (int i = 0; i < variation_.evaluations; ++i) {
    std::unique_ptr<sim::CartPendulumPlant> own;
    if (variation_.parameter_fraction > 0) {
      sim::PlantSettings settings = settings_;
      settings.parameters = varied(settings.parameters, variation_, seed, i);
      own = sim::make_plant(settings);
    }
    const Outcome outcome = once(own ? *own : *plant_, varied(start, variation_, seed, i));
    if (!outcome.is_ok()) return outcome;
    sum += outcome.reward();
  }
  return Outcome::ok(sum / variation_.evaluations);
}

}  // namespace treeroll
