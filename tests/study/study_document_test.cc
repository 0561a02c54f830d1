#include "learner/study/study_document.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/study/study_text.h"

namespace treeroll {
namespace {

using nlohmann::json;
using study_test::StudyText;
using testing::ElementsAre;
using testing::HasSubstr;

using Overrides = std::vector<std::string>;

struct DocumentCondition {
  std::string name;
  json settings;
  SettingOrigins origins;
};

std::vector<DocumentCondition> conditions_of(const StudyText& file,
                                             const Overrides& overrides = {}) {
  const StudyDocument document(file.path(), overrides);
  std::vector<DocumentCondition> conditions;
  for (std::size_t i = 0; i < document.num_conditions(); ++i) {
    DocumentCondition condition{.name = document.name(i), .settings = {}, .origins = {}};
    condition.origins = document.settings(i, condition.settings);
    conditions.push_back(condition);
  }
  return conditions;
}

std::vector<std::string> names_in(const std::string& text, const Overrides& overrides = {}) {
  std::vector<std::string> names;
  for (const DocumentCondition& c : conditions_of(StudyText(text), overrides))
    names.push_back(c.name);
  return names;
}

TEST(StudyDocumentTest, AConditionsKeysLieOverTheFilesOwn) {
  const StudyText file(R"([study]
rollouts = 300
[policy]
model = "tree"
[policy.em]
steps = 5
regularisation = 0.1
[[conditions]]
name = "flat"
policy.model = "flat"
policy.em.steps = 9
[[conditions]]
name = "tree"
[conditions.study]
rollouts = 10
)");
  const auto conditions = conditions_of(file);
  ASSERT_EQ(conditions.size(), 2U);
  EXPECT_EQ(conditions[0].settings.at("policy"),
            json::parse(R"({"model":"flat","em":{"steps":9,"regularisation":0.1}})"));
  EXPECT_EQ(conditions[0].settings.at("study"), json::parse(R"({"rollouts":300})"));
  EXPECT_EQ(conditions[1].settings.at("policy"),
            json::parse(R"({"model":"tree","em":{"steps":5,"regularisation":0.1}})"));
  EXPECT_EQ(conditions[1].settings.at("study"), json::parse(R"({"rollouts":10})"));

  const auto line = [&](int i, const std::string& key) {
    return file.shortened(origin_of(conditions[i].origins, key));
  };
  EXPECT_EQ(line(0, "policy.model"), "FILE:10");
  EXPECT_EQ(line(0, "policy.em.steps"), "FILE:11");
  EXPECT_EQ(line(0, "policy.em.regularisation"), "FILE:7");
  EXPECT_EQ(line(0, "policy.missing"), "FILE:3");
  EXPECT_EQ(line(1, "policy.model"), "FILE:4");
  EXPECT_EQ(line(1, "study.rollouts"), "FILE:15");
  EXPECT_EQ(line(1, "exploration.gamma"), "FILE");
}

TEST(StudyDocumentTest, ATableTakesTheValuesPlaceAndTheOtherWayRound) {
  const StudyText file(
      "[policy]\na = 1\nb.c = 2\n[[conditions]]\nname = \"x\"\npolicy.a.d = 3\n"
      "policy.b = 4\n");
  const auto conditions = conditions_of(file);
  EXPECT_EQ(conditions[0].settings.at("policy"), json::parse(R"({"a":{"d":3},"b":4})"));
  EXPECT_EQ(file.shortened(origin_of(conditions[0].origins, "policy.a.d")), "FILE:6");
  EXPECT_EQ(file.shortened(origin_of(conditions[0].origins, "policy.b.c")), "FILE:7");
}

TEST(StudyDocumentTest, ConditionsTimesAxesRunWithTheLastAxisFastest) {
  const std::string text = R"([[conditions]]
name = "flat"
[[conditions]]
name = "tree"
[[axes]]
key = "exploration.initial_noise_factor"
values = [0.1, 2]
[[axes]]
options = [{name = "single", task.goal = 1}, {name = "multi", task.goal = 2, study.in_flight = 8}]
)";
  EXPECT_THAT(
      names_in(text),
      ElementsAre("flat.initial_noise_factor=0.1.single", "flat.initial_noise_factor=0.1.multi",
                  "flat.initial_noise_factor=2.single", "flat.initial_noise_factor=2.multi",
                  "tree.initial_noise_factor=0.1.single", "tree.initial_noise_factor=0.1.multi",
                  "tree.initial_noise_factor=2.single", "tree.initial_noise_factor=2.multi"));
  const StudyText file(text);
  const DocumentCondition last = conditions_of(file).back();
  EXPECT_EQ(last.settings.at("exploration"), json::parse(R"({"initial_noise_factor":2})"));
  EXPECT_EQ(last.settings.at("task"), json::parse(R"({"goal":2})"));
  EXPECT_EQ(last.settings.at("study"), json::parse(R"({"in_flight":8})"));
  EXPECT_EQ(file.shortened(origin_of(last.origins, "exploration.initial_noise_factor")), "FILE:7");
  EXPECT_EQ(file.shortened(origin_of(last.origins, "task.goal")), "FILE:9");
}

TEST(StudyDocumentTest, AxesAloneMakeConditions) {
  EXPECT_THAT(names_in("[[axes]]\nkey = \"task.plant\"\nvalues = [\"ode\", \"rk4\"]\n"),
              ElementsAre("plant=ode", "plant=rk4"));
  EXPECT_THAT(names_in("[[axes]]\nkey = \"policy.x\"\nvalues = [[1, 2.5], true]\n"),
              ElementsAre("x=1_2.5", "x=true"));
}

TEST(StudyDocumentTest, TheCommandLineWinsOverEverything) {
  const StudyText file(R"([exploration]
gamma = 1
[[conditions]]
name = "a"
exploration.gamma = 2
[[axes]]
options = [{name = "b", exploration.gamma = 3}]
)");
  const auto conditions = conditions_of(
      file, {"exploration.gamma=4", "study.name=x", "exploration.gamma=5", "policy={c = 1}"});
  EXPECT_EQ(conditions[0].settings.at("exploration"), json::parse(R"({"gamma":5})"));
  EXPECT_EQ(conditions[0].settings.at("study"), json::parse(R"({"name":"x"})"));
  EXPECT_EQ(conditions[0].settings.at("policy"), json::parse(R"({"c":1})"));
  EXPECT_EQ(origin_of(conditions[0].origins, "exploration.gamma"), "--set");
  EXPECT_EQ(origin_of(conditions[0].origins, "study.name"), "--set");
}

TEST(StudyDocumentTest, TheCommandLineCanReplaceConditionsAndAxes) {
  const std::string text =
      "[[conditions]]\nname = \"a\"\n[[axes]]\nkey = \"task.x\"\nvalues = [1]\n";
  EXPECT_THAT(names_in(text, {"conditions=[{name = \"b\"}, {name = \"c\"}]"}),
              ElementsAre("b.x=1", "c.x=1"));
  EXPECT_THAT(names_in(text, {"axes=[{key = \"task.x\", values = [5, 6]}]"}),
              ElementsAre("a.x=5", "a.x=6"));
}

std::string refusal_of_document(const std::string& text, const Overrides& overrides = {}) {
  const StudyText file(text);
  return study_test::error_of(file, [&](const auto& path) { StudyDocument(path, overrides); });
}

constexpr const char* kOneCondition = "[[conditions]]\nname = \"a\"\n";
constexpr const char* kOneAxis = "[[axes]]\nkey = \"exploration.gamma\"\nvalues = [1, 2]\n";

TEST(StudyDocumentTest, BadConditionsAreRefusedWithTheirLine) {
  const auto expect = [](const std::string& text, const std::string& error) {
    EXPECT_EQ(refusal_of_document(text), error) << text;
  };
  expect("[study]\nname = \"x\"\n",
         "FILE: conditions: is missing: a study has [[conditions]] or [[axes]]");
  expect("\nconditions = []\n", "FILE:2: conditions: must be a list that is not empty");
  expect("[conditions]\nname = \"a\"\n", "FILE:1: conditions: must be a list that is not empty");
  expect("conditions = [1]\n", "FILE:1: conditions[0] = 1: must be a table");
  expect("[[conditions]]\npolicy.model = \"flat\"\n",
         "FILE:1: conditions[0].name: is required and missing");
  expect("[[conditions]]\nname = 5\n", "FILE:2: conditions[0].name = 5: must be a string");
  expect("[[conditions]]\nname = \"\"\n", "FILE:2: conditions[0].name = \"\": must not be empty");
  expect("[[conditions]]\nname = \"a\"\n\n[[conditions]]\nname = \"a\"\n",
         "FILE:5: conditions.name = \"a\": must be unique");
  EXPECT_THAT(refusal_of_document("[[conditions]]\nname = \"a,b\"\n"),
              HasSubstr("FILE:2: conditions.name = \"a,b\": must be 1 to 128 letters, digits"));
  EXPECT_THAT(refusal_of_document("[[conditions]]\nname = \"../a\"\n"),
              HasSubstr("FILE:2: conditions.name"));
  EXPECT_THAT(refusal_of_document("[[conditions]]\nname = \"" + std::string(129, 'a') + "\"\n"),
              HasSubstr("FILE:2: conditions.name"));
  EXPECT_THAT(refusal_of_document("[[conditions]]\nname = \"a\"\nmodel = 1\n"),
              HasSubstr("FILE:3: conditions[0].model: unknown key; known here: name, study"));
  expect("[[conditions]]\nname = \"a\"\npolicy = 1\n",
         "FILE:3: conditions[0].policy: must be a table");
  expect("[[conditions]]\nname = \"a\"\nstudy.seed = 1\n",
         "FILE:3: conditions[0].study.seed: only study.rollouts and study.in_flight may differ "
         "between the conditions of a study");
  EXPECT_THAT(refusal_of_document(std::string("explore.x = 1\n") + kOneCondition),
              HasSubstr("FILE:1: explore: unknown key; known here: extends, study, task, policy"));
  expect(std::string("policy = 5\n") + kOneCondition, "FILE:1: policy = 5: must be a table");
}

TEST(StudyDocumentTest, BadAxesAreRefusedWithTheirLine) {
  const auto expect = [](const std::string& axis, const std::string& error) {
    EXPECT_EQ(refusal_of_document("[[axes]]\n" + axis), error) << axis;
  };
  expect("key = \"task.x\"\n", "FILE:1: axes[0].values: is required and missing");
  expect("key = \"task.x\"\nvalues = []\n",
         "FILE:3: axes[0].values: must be a list that is not empty");
  expect("key = \"task\"\nvalues = [1]\n",
         "FILE:2: axes[0].key = \"task\": must be the dotted key of a setting in study, task, "
         "policy, exploration");
  expect("key = \"task..x\"\nvalues = [1]\n",
         "FILE:2: axes[0].key = \"task..x\": must be the dotted key of a setting in study, task, "
         "policy, exploration");
  expect("key = \"study.seed\"\nvalues = [1]\n",
         "FILE:2: axes[0].key = \"study.seed\": only study.rollouts and study.in_flight may differ "
         "between the "
         "conditions of a study");
  expect("key = \"task.x\"\nvalues = [{a = 1}]\n",
         "FILE:3: axes[0].values: must be numbers, words or lists of them; see options");
  expect("key = \"task.x\"\nvalues = [1, 1]\n",
         "FILE:3: conditions.name = \"x=1\": must be unique");
  expect("key = \"task.x\"\nvalues = [1]\noptions = [{name = \"a\"}]\n",
         "FILE:2: axes[0].key: an axis has either key and values, or options; and a name, or none");
  expect("options = [{task.x = 1}]\n", "FILE:2: axes[0].options[0].name: is required and missing");
}

TEST(StudyDocumentTest, HugeGridsAreRefusedBeforeTheyAreMade) {
  std::string text;
  for (int axis = 0; axis < 40; ++axis) {
    text += "[[axes]]\nkey = \"task.x" + std::to_string(axis) + "\"\nvalues = [1";
    for (int i = 2; i <= 500; ++i) text += ", " + std::to_string(i);
    text += "]\n";
  }
  EXPECT_EQ(refusal_of_document(text),
            "FILE:1: axes: make 250000 conditions or more: must be at most 1000");
  std::string many;
  for (int i = 0; i < 1001; ++i) many += "[[conditions]]\nname = \"c" + std::to_string(i) + "\"\n";
  EXPECT_EQ(refusal_of_document(many),
            "FILE:1: conditions: holds 1001 entries: must be at most 1000");
}

TEST(StudyDocumentTest, BadOverridesAreRefusedAsComingFromTheCommandLine) {
  EXPECT_THAT(refusal_of_document(kOneCondition, {"explore.x=1"}),
              HasSubstr("--set: explore.x = 1: unknown"));
  EXPECT_THAT(refusal_of_document(kOneCondition, {"conditions.name=b"}),
              HasSubstr("--set: conditions.name"));
  EXPECT_EQ(refusal_of_document(kOneCondition, {"policy=1"}), "--set: policy = 1: must be a table");
  EXPECT_EQ(refusal_of_document(kOneCondition, {"conditions=5"}),
            "--set: conditions: must be a list that is not empty");
  EXPECT_EQ(refusal_of_document(kOneCondition, {"conditions=[{name = 5}]"}),
            "--set: conditions[0].name = 5: must be a string");
}

TEST(StudyDocumentTest, AnOverrideOfAKeyThatAnAxisVariesIsRefused) {
  for (const char* setting : {"exploration.gamma=5", "exploration={gamma = 5}"}) {
    EXPECT_EQ(refusal_of_document(kOneAxis, {setting}),
              "--set: " + std::string(setting) +
                  ": exploration.gamma is varied by an axis of this study; override axes instead");
  }
  EXPECT_EQ(refusal_of_document(kOneAxis, {"exploration.gamma2=5"}), "");
  const std::string options =
      "[[axes]]\noptions = [{name = \"bold\", exploration.initial_noise_factor = 1.0}, "
      "{name = \"timid\", exploration.initial_noise_factor = 0.01, policy.fit.seed = 3}]\n";
  for (const char* key : {"exploration.initial_noise_factor", "policy.fit.seed", "policy.fit"}) {
    EXPECT_THAT(refusal_of_document(options, {std::string(key) + "=0.5"}),
                HasSubstr("is varied by an axis of this study"))
        << key;
  }
  EXPECT_EQ(refusal_of_document(options, {"exploration.first_update=5"}), "");
}

}  // namespace
}  // namespace treeroll
