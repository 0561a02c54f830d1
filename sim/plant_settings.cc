#include "sim/plant_settings.h"

#include <string>

#include "sim/ode_plant.h"
#include "sim/rk4_plant.h"

namespace treeroll::sim {
namespace {

/// A shorter step would let one roll-out take minutes; a longer one is no simulation any more.
constexpr NumberRule kStep{.min = 1e-6, .max = .1};
/// Below, doubles cannot hold it; above, the integrator ignores it.
constexpr NumberRule kTolerance{.min = 1e-14, .max = 1};
/// Masses, lengths and inertias: the ranges keep the mass matrix far from singular.
constexpr NumberRule kSize{.min = 1e-6, .max = 1e6};
constexpr NumberRule kFriction{.min = 0, .max = 1e6};

DoublePendulum read_parameters(SettingsReader table) {
  const DoublePendulum standard;
  DoublePendulum p;
  p.l1 = table.number("l1", kSize, standard.l1);
  p.l2 = table.number("l2", kSize, standard.l2);
  p.a1 = table.number("a1", kSize, standard.a1);
  p.a2 = table.number("a2", kSize, standard.a2);
  p.m1 = table.number("m1", kSize, standard.m1);
  p.m2 = table.number("m2", kSize, standard.m2);
  p.j1 = table.number("j1", kSize, standard.j1);
  p.j2 = table.number("j2", kSize, standard.j2);
  p.d1 = table.number("d1", kFriction, standard.d1);
  p.d2 = table.number("d2", kFriction, standard.d2);
  p.gravity = table.number("gravity", NumberRule{.min = 0, .max = 1e3}, standard.gravity);
  table.finish();
  return p;
}

Dopri5Settings read_dopri5(SettingsReader& settings) {
  Dopri5Settings dopri5;
  dopri5.output_step_s = settings.number("output_step_s", kStep, dopri5.output_step_s);
  dopri5.absolute_tolerance =
      settings.number("absolute_tolerance", kTolerance, dopri5.absolute_tolerance);
  dopri5.relative_tolerance =
      settings.number("relative_tolerance", kTolerance, dopri5.relative_tolerance);
  dopri5.steps_max = settings.integer("steps_max", 1, 1'000'000'000, dopri5.steps_max);
  return dopri5;
}

}  // namespace

PlantSettings read_plant_settings(SettingsReader& settings) {
  PlantSettings plant;
  const std::string kind = settings.choice("plant", {"ode", "rk4", "dopri5"}, "ode");
  if (kind == "dopri5") {
    plant.kind = PlantKind::kDopri5;
    plant.dopri5 = read_dopri5(settings);
  } else {
    plant.kind = kind == "ode" ? PlantKind::kOde : PlantKind::kRk4;
    plant.step_s = settings.number("step_s", kStep, plant.step_s);
  }
  plant.parameters = read_parameters(settings.table("parameters"));
  return plant;
}

std::unique_ptr<CartPendulumPlant> make_plant(const PlantSettings& settings) {
  switch (settings.kind) {
    case PlantKind::kOde:
      return std::make_unique<OdePlant>(settings.parameters, settings.step_s);
    case PlantKind::kRk4:
      return std::make_unique<Rk4Plant>(settings.parameters, settings.step_s);
    case PlantKind::kDopri5:
      return std::make_unique<Dopri5Plant>(settings.parameters, settings.dopri5);
  }
  CHECK(false, "a plant of no kind");
}

}  // namespace treeroll::sim
