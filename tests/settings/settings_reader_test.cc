#include "common/settings/settings_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

std::string error_of(const char* text, const std::function<void(SettingsReader&)>& read) {
  const json table = json::parse(text);
  json resolved;
  try {
    SettingsReader reader(table, "task", resolved);
    read(reader);
    reader.finish();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(SettingsReaderTest, GivesWhatIsThereAndElseTheFallback) {
  const json table =
      json::parse(R"({"a": 2, "s": "x", "list": [1, 2.5], "b": true, "t": {"n": 3}})");
  json resolved;
  SettingsReader reader(table, "task", resolved);
  EXPECT_EQ(reader.number("a", kPositive), 2);
  EXPECT_EQ(reader.number("absent", kPositive, .5), .5);
  EXPECT_EQ(reader.string("s"), "x");
  EXPECT_TRUE(reader.boolean("b"));
  EXPECT_EQ(reader.numbers("list", kAnyNumber, 2, 2), (std::vector<double>{1, 2.5}));
  SettingsReader nested = reader.table("t");
  EXPECT_EQ(nested.integer("n", 0, 10), 3);
  nested.finish();
  reader.finish();
  EXPECT_EQ(resolved, json::parse(R"({"a": 2.0, "absent": 0.5, "s": "x", "b": true,
                                      "list": [1.0, 2.5], "t": {"n": 3}})"));
}

TEST(SettingsReaderTest, NamesKeyValueAndRule) {
  EXPECT_EQ(error_of(R"({"a": -1})", [](auto& r) { r.number("a", kPositive); }),
            "task.a = -1: must be a finite number above 0");
  EXPECT_EQ(error_of(R"({"a": "x"})", [](auto& r) { r.integer("a", 1, 5); }),
            "task.a = \"x\": must be an integer from 1 to 5");
  EXPECT_EQ(error_of(R"({"a": 1.5})", [](auto& r) { r.integer("a", 1, 5); }),
            "task.a = 1.5: must be an integer from 1 to 5");
  EXPECT_EQ(error_of("{}", [](auto& r) { r.string("a"); }), "task.a: is required and missing");
  EXPECT_EQ(error_of(R"({"a": "z"})",
                     [](auto& r) {
                       r.choice("a", {"x", "y"});
                     }),
            "task.a = \"z\": must be one of: x, y");
  EXPECT_EQ(error_of(R"({"a": [1]})", [](auto& r) { r.numbers("a", kAnyNumber, 2, 2); }),
            "task.a = [1]: must hold 2 numbers");
  EXPECT_EQ(error_of(R"({"t": 3})", [](auto& r) { r.table("t"); }), "task.t = 3: must be a table");
}

TEST(SettingsReaderTest, ReadsRowsAndPlainNumbersInTheirPlace) {
  using Rows = std::vector<std::vector<double>>;
  const json table = json::parse(R"({"two": [[1, 2], [3, 4]], "one_row": [5, 6], "columns": [7, 8],
                                     "words": ["a", "b"]})");
  json resolved;
  SettingsReader reader(table, "task", resolved);
  EXPECT_EQ(reader.rows("two", kAnyNumber, 2, 2, 2), (Rows{{1, 2}, {3, 4}}));
  EXPECT_EQ(reader.rows("one_row", kAnyNumber, 2, 2, 3), (Rows{{5, 6}}));
  EXPECT_EQ(reader.rows("columns", kAnyNumber, 2, 1, 1), (Rows{{7}, {8}}));
  EXPECT_EQ(reader.rows("absent", kAnyNumber, 2, 2, 2, Rows{{0, 9}}), (Rows{{0, 9}}));
  EXPECT_EQ(reader.strings("words", 2), (std::vector<std::string>{"a", "b"}));
  reader.finish();
  const json first = resolved;
  SettingsReader again(first, "task", resolved = {});
  again.rows("columns", kAnyNumber, 2, 1, 1);
  EXPECT_EQ(resolved["columns"], first["columns"]);
}

TEST(SettingsReaderTest, RefusesRowsThatAreNoTable) {
  const auto error = [](const char* text) {
    return error_of(text, [](auto& r) { r.rows("a", kNotNegative, 2, 2, 3); });
  };
  EXPECT_EQ(error(R"({"a": 1})"), "task.a = 1: must be a list of lists of numbers");
  EXPECT_THAT(error(R"({"a": []})"), HasSubstr("must be a list of lists"));
  EXPECT_THAT(error(R"({"a": [[1, 2], 3]})"), HasSubstr("must be a list of lists"));
  EXPECT_THAT(error(R"({"a": [1, [2, 3]]})"), HasSubstr("must be a list of lists"));
  EXPECT_THAT(error(R"({"a": [[1, "x"]]})"), HasSubstr("each number of the lists must be"));
  EXPECT_THAT(error(R"({"a": [[1, -2]]})"), HasSubstr("of at least 0"));
  EXPECT_THAT(error(R"({"a": [[1, 2], [1, 2, 3]]})"), HasSubstr("equally long"));
  EXPECT_THAT(error(R"({"a": [[1]]})"), HasSubstr("from 2 to 3 numbers"));
  EXPECT_THAT(error(R"({"a": [[1, 2], [1, 2], [1, 2]]})"), HasSubstr("at most 2 lists"));
  EXPECT_THAT(error_of(R"({"a": ["x", 1]})", [](auto& r) { r.strings("a", 3); }),
              HasSubstr("must be a list of 1 to 3 strings"));
}

TEST(SettingsReaderTest, RefusesAKeyNobodyAskedFor) {
  EXPECT_THAT(error_of(R"({"a": 1, "aa": 2})", [](auto& r) { r.number("a", kAnyNumber); }),
              HasSubstr("task.aa = 2: unknown key; known here: a"));
}

TEST(SettingsReaderTest, RefusesAnUnsignedNumberPastTheSignedRange) {
  EXPECT_THAT(error_of(R"({"a": 18446744073709551615})", [](auto& r) { r.integer("a", -5, 5); }),
              HasSubstr("must be an integer from -5 to 5"));
}

}  // namespace
}  // namespace treeroll
