#pragma once

#include <memory>

#include "common/settings/settings_reader.h"
#include "sim/cart_pendulum.h"
#include "sim/dopri5_plant.h"

namespace treeroll::sim {

enum class PlantKind {
  kOde,     ///< Open Dynamics Engine
  kRk4,     ///< equations of motion, fixed step
  kDopri5,  ///< equations of motion, step control
};

/// Which plant, how accurate, and its physical parameters.
struct PlantSettings {
  PlantKind kind = PlantKind::kOde;
  double step_s = 1e-3;   ///< of ode and rk4
  Dopri5Settings dopri5;  ///< of dopri5
  DoublePendulum parameters;
  bool operator==(const PlantSettings&) const = default;
};

/// Reads the plant's keys out of the table of a task, strictly (those of another kind of plant are
/// left unasked, so that the table's finish() refuses them):
///
///   plant = "ode"               # or "rk4", "dopri5"
///   step_s = 1e-3               # ode and rk4
///   output_step_s = 1e-3        # dopri5, as are the next three
///   relative_tolerance = 1e-9
///   absolute_tolerance = 1e-12
///   steps_max = 1000000
///   parameters = {m1 = .853}    # any of DoublePendulum's names
///
/// Throws ConfigError.
PlantSettings read_plant_settings(SettingsReader& settings);

std::unique_ptr<CartPendulumPlant> make_plant(const PlantSettings& settings);

}  // namespace treeroll::sim
