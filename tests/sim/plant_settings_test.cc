#include "sim/plant_settings.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/base/config_error.h"

namespace treeroll::sim {
namespace {

using nlohmann::json;

PlantSettings read(const char* text) {
  const json table = json::parse(text);
  json resolved;
  SettingsReader reader(table, "task", resolved);
  const PlantSettings settings = read_plant_settings(reader);
  reader.finish();
  return settings;
}

std::string error_of(const char* text) {
  try {
    read(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(PlantSettingsTest, AreOdeAtOneMillisecondByDefault) {
  EXPECT_EQ(read("{}"), PlantSettings{});
  EXPECT_EQ(PlantSettings{}.kind, PlantKind::kOde);
  EXPECT_EQ(PlantSettings{}.step_s, 1e-3);
}

TEST(PlantSettingsTest, TakeEveryKey) {
  const PlantSettings rk4 = read(R"({"plant": "rk4", "step_s": 0.005, "parameters":
      {"l1": 1, "l2": 2, "a1": 3, "a2": 4, "m1": 5, "m2": 6, "j1": 7, "j2": 8, "d1": 9, "d2": 10,
       "gravity": 1.62}})");
  EXPECT_EQ(rk4.kind, PlantKind::kRk4);
  EXPECT_EQ(rk4.step_s, .005);
  EXPECT_EQ(rk4.parameters, (DoublePendulum{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 1.62}));
  const PlantSettings dopri5 = read(R"({"plant": "dopri5", "output_step_s": 0.01,
      "absolute_tolerance": 1e-8, "relative_tolerance": 1e-7, "steps_max": 50})");
  EXPECT_EQ(dopri5.kind, PlantKind::kDopri5);
  EXPECT_EQ(dopri5.dopri5, (Dopri5Settings{.output_step_s = .01,
                                           .relative_tolerance = 1e-7,
                                           .absolute_tolerance = 1e-8,
                                           .steps_max = 50}));
}

TEST(PlantSettingsTest, MakeThePlantTheyDescribe) {
  for (const char* text :
       {R"({"plant": "ode"})", R"({"plant": "rk4"})", R"({"plant": "dopri5"})"}) {
    const auto plant = make_plant(read(text));
    const auto end = plant->simulate(
        {.phi1 = .1}, .01, [](double, const CartPendulumState&) { return 0.; },
        [](double, const CartPendulumState&, double) { return true; });
    ASSERT_TRUE(end) << text;
    EXPECT_GT(end->phi1, .1);
  }
}

TEST(PlantSettingsTest, RefuseWhatDoesNotBelongToTheKindOfPlant) {
  EXPECT_NE(error_of(R"({"plant": "ode", "relative_tolerance": 1e-6})").find("unknown key"),
            std::string::npos);
  EXPECT_NE(error_of(R"({"plant": "dopri5", "step_s": 1e-3})").find("unknown key"),
            std::string::npos);
}

TEST(PlantSettingsTest, NameTheKeyTheValueAndTheRule) {
  EXPECT_EQ(error_of(R"({"plant": "bullet"})"),
            "task.plant = \"bullet\": must be one of: ode, rk4, dopri5");
  EXPECT_EQ(error_of(R"({"step_s": 0})"),
            "task.step_s = 0: must be a finite number of at least 1e-06 and at most 0.1");
  EXPECT_NE(error_of(R"({"parameters": {"m1": -1}})").find("task.parameters.m1 = -1"),
            std::string::npos);
  EXPECT_NE(error_of(R"({"parameters": {"mass": 1}})").find("task.parameters.mass = 1: unknown"),
            std::string::npos);
}

}  // namespace
}  // namespace treeroll::sim
