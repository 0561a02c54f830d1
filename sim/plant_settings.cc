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
  p.l1 =
      table.number("l1", kSize, standard.l1, {.meaning = "Length of the first link", .unit = "m"});
  p.l2 =
      table.number("l2", kSize, standard.l2, {.meaning = "Length of the second link", .unit = "m"});
  p.a1 = table.number("a1", kSize, standard.a1,
                      {.meaning = "First joint to centre of gravity", .unit = "m"});
  p.a2 = table.number("a2", kSize, standard.a2,
                      {.meaning = "Second joint to centre of gravity", .unit = "m"});
  p.m1 =
      table.number("m1", kSize, standard.m1, {.meaning = "Mass of the first link", .unit = "kg"});
  p.m2 =
      table.number("m2", kSize, standard.m2, {.meaning = "Mass of the second link", .unit = "kg"});
  p.j1 = table.number(
      "j1", kSize, standard.j1,
      {.meaning = "Inertia of the first link about its centre of gravity", .unit = "kg m^2"});
  p.j2 = table.number(
      "j2", kSize, standard.j2,
      {.meaning = "Inertia of the second link about its centre of gravity", .unit = "kg m^2"});
  p.d1 = table.number("d1", kFriction, standard.d1,
                      {.meaning = "Viscous friction of the first joint", .unit = "N m s"});
  p.d2 = table.number("d2", kFriction, standard.d2,
                      {.meaning = "Viscous friction of the second joint", .unit = "N m s"});
  p.gravity = table.number("gravity", NumberRule{.min = 0, .max = 1e3}, standard.gravity,
                           {.meaning = "Gravity", .unit = "m/s^2"});
  table.finish();
  return p;
}

Dopri5Settings read_dopri5(SettingsReader& settings) {
  Dopri5Settings dopri5;
  dopri5.output_step_s =
      settings.number("output_step_s", kStep, dopri5.output_step_s,
                      {.meaning = "Between the steps that are looked at", .unit = "s"});
  dopri5.absolute_tolerance =
      settings.number("absolute_tolerance", kTolerance, dopri5.absolute_tolerance,
                      {.meaning = "Of a step of the simulation"});
  dopri5.relative_tolerance =
      settings.number("relative_tolerance", kTolerance, dopri5.relative_tolerance,
                      {.meaning = "Of a step of the simulation"});
  dopri5.steps_max = settings.integer("steps_max", 1, 1'000'000'000, dopri5.steps_max,
                                      {.meaning = "More steps fail the roll-out"});
  return dopri5;
}

}  // namespace

PlantSettings read_plant_settings(SettingsReader& settings) {
  PlantSettings plant;
  const std::string kind =
      settings.choice("plant", {"ode", "rk4", "dopri5"}, "ode",
                      {.meaning = "What simulates: Open Dynamics Engine, or the equations of "
                                  "motion with a fixed step, or with step control"});
  if (kind == "dopri5") {
    plant.kind = PlantKind::kDopri5;
    plant.dopri5 = read_dopri5(settings);
  } else {
    plant.kind = kind == "ode" ? PlantKind::kOde : PlantKind::kRk4;
    plant.step_s = settings.number("step_s", kStep, plant.step_s,
                                   {.meaning = "Of the simulation", .unit = "s"});
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
