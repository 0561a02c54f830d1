#include "common/settings/settings_reference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/settings/settings_reader.h"

namespace treeroll {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(SettingsReferenceTest, ListsKeyTypeBoundsDefaultAndMeaning) {
  const SettingsReference keys = list_settings("task", [](SettingsReader& reader) {
    reader.number("step_s", {.min = 0, .max = 1, .min_allowed = false}, 1e-3,
                  {.meaning = "Of the simulation", .unit = "s"});
    reader.integer("samples", 2, 100);
    reader.optional_number("stop_at", kPositive);
    reader.numbers("p", kAnyNumber, 1, 4, std::vector<double>{1, 2});
    reader.rows("means", kAnyNumber, 64, 2, 2);
    reader.strings("inputs", 3, {.example = "[\"t_s\"]"});
    reader.table("goal").choice("kind", {"a", "b"}, "b");
  });
  EXPECT_EQ(reference_text(keys, ""),
            "- `task.step_s`: number in s, above 0 to 1; default 0.001. Of the simulation.\n"
            "- `task.samples`: integer, 2 to 100; required.\n"
            "- `task.stop_at`: number, above 0; default none.\n"
            "- `task.p`: 1 to 4 numbers; default [1.0,2.0].\n"
            "- `task.means`: 1 to 64 rows of 2 numbers; required.\n"
            "- `task.inputs`: 1 to 3 strings; required; as in `[\"t_s\"]`.\n"
            "- `task.goal.kind`: \"a\" or \"b\"; default \"b\".\n");
  EXPECT_THAT(keys.refused, ElementsAre());
}

TEST(SettingsReferenceTest, FindsKeysOfEveryWordOfAChoiceAndOfChoicesBelow) {
  const SettingsReference keys = list_settings("exploration", [](SettingsReader& reader) {
    const std::string rule = reader.choice("rule", {"power", "pi2", "cem"}, "power");
    if (rule == "power") {
      reader.integer("first_update", 1, 9, 5);
    } else {
      reader.integer("population", 2, 9, 6);
      if (rule == "cem" && reader.boolean("few", false)) reader.number("elites", kPositive);
    }
  });
  EXPECT_EQ(reference_text(keys, ""),
            "- `exploration.rule`: \"power\" or \"pi2\" or \"cem\"; default \"power\".\n"
            "- `exploration.first_update`: integer, 1 to 9; default 5; only `exploration.rule = "
            "\"power\"`.\n"
            "- `exploration.population`: integer, 2 to 9; default 6; only `exploration.rule = "
            "\"pi2\"` or `\"cem\"`.\n"
            "- `exploration.few`: true or false; default false; only `exploration.rule = "
            "\"cem\"`.\n"
            "- `exploration.elites`: number, above 0; required; only `exploration.few = true`, "
            "and\n  `exploration.rule = \"cem\"`.\n");
}

TEST(SettingsReferenceTest, FindsWhatAKeyBringsThatMayBeAbsent) {
  const SettingsReference keys = list_settings("", [](SettingsReader& reader) {
    // Its default depends on a key that is or is not there: that alone brings no key.
    const std::string rule = reader.choice("rule", {"a", "b"}, reader.has("noise") ? "a" : "b");
    if (rule == "a") reader.integer("of_a", 1, 2, 1);
    if (reader.has("noise")) {
      reader.number("noise", kPositive);
      reader.number("factor", kPositive, 1);
    } else {
      reader.number("scale", kPositive, 2);
    }
  });
  const std::string text = reference_text(keys, "");
  EXPECT_THAT(text, HasSubstr("- `noise`: number, above 0; default none.\n"));
  EXPECT_THAT(text, HasSubstr("- `factor`: number, above 0; default 1.0; only with `noise`.\n"));
  EXPECT_THAT(text, HasSubstr("- `scale`: number, above 0; default 2.0; only without `noise`.\n"));
  EXPECT_THAT(text, HasSubstr("- `of_a`: integer, 1 to 2; default 1; only `rule = \"a\"`.\n"));
  EXPECT_THAT(text, HasSubstr("default \"a\"; only with `noise`"));
  EXPECT_THAT(text, HasSubstr("default \"b\"; only without `noise`"));
}

TEST(SettingsReferenceTest, AConditionIsNoneWhereAnotherReadingHasTheKeyWithoutIt) {
  const SettingsReference keys = list_settings("exploration", [](SettingsReader& reader) {
    const bool is_cma = reader.choice("rule", {"cma", "cem"}, "cma") == "cma";
    if (!is_cma || reader.choice("coordinates", {"effect", "noise"}, "effect") == "noise") {
      reader.integer("metric", 1, 2, 1);
    }
  });
  const std::string text = reference_text(keys, "");
  EXPECT_THAT(text, HasSubstr("`exploration.coordinates`: \"effect\" or \"noise\"; default "
                              "\"effect\"; only `exploration.rule = \"cma\"`.\n"));
  EXPECT_THAT(text, testing::Not(HasSubstr("only `exploration.coordinates")));
}

/// Two kinds ask one question, and what hangs on the answer is another key with each.
TEST(SettingsReferenceTest, AQuestionIsTriedBesideEachWordThatBringsOtherKeys) {
  const SettingsReference keys = list_settings("policy", [](SettingsReader& reader) {
    const std::string kind = reader.choice("kind", {"tree", "spline", "network"}, "tree");
    if (kind == "network") {
      reader.integer("hidden", 1, 9, 5);
      return;
    }
    const bool is_constant = reader.choice("start", {"fit", "constant"}, "fit") == "constant";
    if (kind == "spline") reader.integer("degree", 0, 7, 3);
    if (is_constant) reader.number("range", kPositive, kind == "tree" ? 1 : 2);
    if (is_constant) reader.integer("value", 0, 1, 0);
  });
  const std::string text = reference_text(keys, "");
  EXPECT_THAT(text, HasSubstr("- `policy.range`: number, above 0; default 1.0; only "
                              "`policy.start = \"constant\"`.\n"));
  EXPECT_THAT(text, HasSubstr("- `policy.range`: number, above 0; default 2.0; only `policy.kind = "
                              "\"spline\"`, and `policy.start =\n  \"constant\"`.\n"));
  EXPECT_THAT(text,
              HasSubstr("- `policy.value`: integer, 0 to 1; default 0; only `policy.kind = "
                        "\"tree\"` or `\"spline\"`, and\n  `policy.start = \"constant\"`.\n"));
}

/// What chooses a kind by itself asks the questions of the kind that it comes to.
TEST(SettingsReferenceTest, AConditionHoldsOfEveryReadingThatHasTheKey) {
  const SettingsReference keys = list_settings("policy", [](SettingsReader& reader) {
    const std::string kind = reader.choice("kind", {"auto", "spline", "network"}, "spline");
    if (kind == "network" || (kind == "auto" && reader.has("ranges"))) {
      reader.integer("hidden", 1, 9, 5);
    } else {
      reader.integer("degree", 0, 7, 3);
    }
  });
  const std::string text = reference_text(keys, "");
  EXPECT_THAT(text, HasSubstr("`policy.hidden`: integer, 1 to 9; default 5; only `policy.kind = "
                              "\"auto\"` or `\"network\"`.\n"));
  EXPECT_THAT(text, HasSubstr("`policy.degree`: integer, 0 to 7; default 3; only `policy.kind = "
                              "\"auto\"` or `\"spline\"`.\n"));
}

TEST(SettingsReferenceTest, NumberedTablesAreOnePlace) {
  const SettingsReference keys = list_settings("policy", [](SettingsReader& reader) {
    for (int layer = 1; layer <= 8; ++layer) {
      const std::string key = "layer_" + std::to_string(layer);
      if (layer > 1 && !reader.has(key)) break;
      SettingsReader table = reader.table(key);
      table.number("mean", kAnyNumber);
      if (layer > 1) table.integer("parent", 1, 4);
    }
  });
  EXPECT_EQ(reference_text(keys, ""),
            "- `policy.layer_N.mean`: number; required.\n"
            "- `policy.layer_N.parent`: integer, 1 to 4; required; only with `policy.layer_N`.\n");
}

TEST(SettingsReferenceTest, TellsWhatWasRefusedAndDoesNotTakeSilenceForAbsence) {
  const SettingsReference keys = list_settings("policy", [](SettingsReader& reader) {
    if (reader.choice("start", {"fit", "other"}, "fit") == "other") {
      reader.refuse("start", "is not possible here");
    }
    reader.integer("layers", 1, 2, 1);
  });
  EXPECT_THAT(keys.refused, ElementsAre("policy.start = \"other\": policy.start = \"other\": is "
                                        "not possible here"));
  EXPECT_THAT(reference_text(keys, ""),
              HasSubstr("`policy.layers`: integer, 1 to 2; default 1.\n"));
}

TEST(SettingsReferenceTest, AKeyIsOptionalHoweverLateThatShows) {
  const SettingsReference keys = list_settings("d", [](SettingsReader& reader) {
    if (reader.has("content") && !reader.has("files")) {
      reader.string("content");
    } else {
      reader.strings("files", 3);
    }
  });
  EXPECT_EQ(reference_text(keys, ""),
            "- `d.files`: 1 to 3 strings; default none.\n"  // beside d.content too
            "- `d.content`: text; default none; only without `d.files`.\n");
  ASSERT_EQ(keys.plain.size(), 1u);
  EXPECT_EQ(keys.plain[0].key, "d.files");
}

TEST(SettingsReferenceTest, APatternChoosesByKeyOrMeaning) {
  const SettingsReference keys = list_settings("study", [](SettingsReader& reader) {
    reader.integer("seed", 0, 9, 1, {.meaning = "Of all random numbers"});
    reader.integer("rollouts", 1, 9);
  });
  EXPECT_EQ(reference_text(keys, "Random"),
            "- `study.seed`: integer, 0 to 9; default 1. Of all random numbers.\n");
  EXPECT_EQ(reference_part("[study]", keys, "nothing like it"), "");
  EXPECT_THAT(reference_part("[study]", keys, "ROLL"), HasSubstr("## [study]\n\n- `study.roll"));
}

}  // namespace
}  // namespace treeroll
