#include "learner/study/toml_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "learner/study/toml_depth.h"
#include "tests/study/study_text.h"

namespace treeroll {
namespace {

using nlohmann::json;
using study_test::StudyText;
using testing::HasSubstr;
using testing::StartsWith;
using namespace std::string_literals;

json content_of(const std::string& text) {
  const StudyText file(text);
  json content;
  read_toml_file(file.path(), content, "a key");
  return content;
}

std::string refusal_of_toml(const std::string& text) {
  const StudyText file(text);
  return study_test::error_of(file, [](const auto& path) {
    json content;
    read_toml_file(path, content, "a key");
  });
}

std::string repeated(const std::string& part, int times) {
  std::string text;
  for (int i = 0; i < times; ++i) text += part;
  return text;
}

TEST(TomlSourceTest, IntegersAndFloatsStayApart) {
  const json content = content_of("a = 1\nb = 1.0\nc = true\nd = \"x\"\ne = [1, 2.5]\n");
  EXPECT_TRUE(content.at("a").is_number_integer());
  EXPECT_TRUE(content.at("b").is_number_float());
  EXPECT_EQ(content, json::parse(R"({"a":1,"b":1.0,"c":true,"d":"x","e":[1,2.5]})"));
}

TEST(TomlSourceTest, EveryKeyKnowsItsLine) {
  const StudyText file("a = 1\n[b]\nc.d = 2\n[[e]]\nf = 3\n[[e]]\n\nf = 4\n");
  json content;
  const SettingOrigins origins = read_toml_file(file.path(), content, "a key");
  const auto line = [&](const std::string& key) { return file.shortened(origin_of(origins, key)); };
  EXPECT_EQ(line("a"), "FILE:1");
  EXPECT_EQ(line("b"), "FILE:2");
  EXPECT_EQ(line("b.c.d"), "FILE:3");
  EXPECT_EQ(line("b.missing"), "FILE:2");
  EXPECT_EQ(line("e[0].f"), "FILE:5");
  EXPECT_EQ(line("e[1]"), "FILE:6");
  EXPECT_EQ(line("e[1].f"), "FILE:8");
  EXPECT_EQ(line("missing"), "FILE");
}

TEST(TomlSourceTest, ErrorsOfSyntaxHaveLineAndColumn) {
  EXPECT_THAT(refusal_of_toml("a = 1\nb = = 2\n"), StartsWith("FILE:2:5: "));
  EXPECT_THAT(refusal_of_toml("a = 1\na = 2\n"), StartsWith("FILE:2:"));
  EXPECT_THAT(refusal_of_toml("[a]\n[a]\n"), StartsWith("FILE:2:"));
  EXPECT_THAT(refusal_of_toml("a = 1\nb = \"not closed\n"), StartsWith("FILE:2:"));
  EXPECT_THAT(refusal_of_toml("a = 1\nb = \"\xff\"\n"), StartsWith("FILE:2:"));
  EXPECT_THAT(refusal_of_toml("a = 1\0\n"s), StartsWith("FILE:1:"));
  EXPECT_THAT(refusal_of_toml("\x7f\x45\x4c\x46\x02\x01"), StartsWith("FILE:1:"));
}

TEST(TomlSourceTest, WhatNoSettingCanHoldIsRefusedWithItsLine) {
  EXPECT_EQ(refusal_of_toml("[a]\nb = inf\n"), "FILE:2: a.b = inf: must be a finite number");
  EXPECT_EQ(refusal_of_toml("[a]\nb = [1, nan]\n"),
            "FILE:2: a.b[1] = nan: must be a finite number");
  EXPECT_EQ(refusal_of_toml("a = 2026-01-02\n"),
            "FILE:1: a = 2026-01-02: is a date or time: no setting takes one");
  EXPECT_EQ(refusal_of_toml("a = \"x\\u0000y\"\n"), "FILE:1: a: must not hold a NUL character");
}

TEST(TomlSourceTest, AnEmptyFileIsRefused) {
  EXPECT_THAT(refusal_of_toml(""), StartsWith("FILE: is empty: must hold at least a key"));
  EXPECT_THAT(refusal_of_toml("# nothing\n\n"),
              StartsWith("FILE: is empty: must hold at least a key"));
}

TEST(TomlSourceTest, WhatIsNoRegularFileIsRefused) {
  const StudyText file("");
  json content;
  const auto error = [&](const std::filesystem::path& path) -> std::string {
    try {
      read_toml_file(path, content, "a key");
    } catch (const StudyError& caught) {
      return caught.what();
    }
    return "";
  };
  EXPECT_EQ(error(file.folder()), file.folder().string() + ": is a folder, must be a file");
  EXPECT_EQ(error("/nowhere/study.toml"), "/nowhere/study.toml: no such file");
  EXPECT_EQ(error(file.path() / "x"), file.path().string() + "/x: cannot be read: Not a directory");
  EXPECT_EQ(error("/dev/null"), "/dev/null: must be a regular file");
  EXPECT_THAT(error(""), HasSubstr("no such file"));
}

TEST(TomlSourceTest, AFileOfMoreThanAMegabyteIsRefused) {
  const std::string comment = "a = 1\n#" + std::string(kStudyBytesMax - 8, 'x') + "\n";
  ASSERT_EQ(comment.size(), kStudyBytesMax);
  EXPECT_EQ(refusal_of_toml(comment), "");
  EXPECT_EQ(refusal_of_toml(comment + "\n"), "FILE: is too large: must be at most 1048576 bytes");
}

TEST(TomlSourceTest, DeepNestingIsRefusedAndOverflowsNoStack) {
  const int many = 250'000;
  const std::string rule = ": is nested deeper than 32 tables";
  EXPECT_EQ(refusal_of_toml("\n[" + repeated("a.", many) + "a]\n"), "FILE:2" + rule);
  EXPECT_EQ(refusal_of_toml(repeated("\"a\" . ", many / 2) + "a = 1\n"), "FILE:1" + rule);
  EXPECT_EQ(refusal_of_toml("a = " + repeated("[", many)), "FILE:1" + rule);
  EXPECT_EQ(refusal_of_toml("a = " + repeated("{a = ", many / 2)), "FILE:1" + rule);
  EXPECT_EQ(refusal_of_toml("x = 1\na = " + repeated("[\n", 33)), "FILE:34" + rule);
  // Each part within the bound, together beyond it.
  EXPECT_THAT(refusal_of_toml("[" + repeated("a.", 31) + "a]\n" + repeated("b.", 31) + "b = 1\n"),
              HasSubstr("is nested deeper than 32 tables"));
}

TEST(TomlSourceTest, DotsThatAreNoKeysAreNotCounted) {
  const std::string dots(100, '.');
  EXPECT_EQ(refusal_of_toml("a = 1 # " + dots + "\nb = \"" + dots + "\"\nc = '" + dots + "'\n"),
            "");
  EXPECT_EQ(refusal_of_toml("a = \"\"\"\n\"" + dots + "\\\"\"\"\"\nb = '''\n'" + dots + "'''''\n"),
            "");
  EXPECT_EQ(refusal_of_toml("a = [" + repeated("0.5, ", 5000) + "1.5]\n"), "");
  EXPECT_EQ(first_line_too_deep("\"a#\".b = 1 # \"\nc = [1, # ]\n2]\n"), 0);
}

TEST(TomlSourceTest, AnyCutOrChangeOfAFileIsReadOrRefused) {
  const std::string text =
      "[study]\nname = \"a\\n\" # c\nx = [1, 2.5e3, [true]]\n[[conditions]]\nname = 'b'\n"
      "policy.model = { a = \"\"\"x\ny\"\"\", b.c = '''z''' }\nd = 0x1f\ne = 1979-05-27\n";
  int num_read = 0;
  int num_refused = 0;
  const auto try_one = [&](const std::string& changed) {
    (refusal_of_toml(changed).empty() ? num_read : num_refused) += 1;
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    try_one(text.substr(0, i));
    for (const char c : {'\0', '"', '[', '}', '\n', '\xff'}) {
      std::string changed = text;
      changed[i] = c;
      try_one(changed);
    }
  }
  EXPECT_GT(num_read, 0);
  EXPECT_GT(num_refused, 0);
}

TEST(TomlSourceTest, ControlCharactersOfTheFileDoNotReachTheTerminal) {
  EXPECT_EQ(refusal_of_toml("\"a\\u001b[2J\" = inf\n"),
            "FILE:1: a?[2J = inf: must be a finite number");
}

json override_value(const std::string& text) {
  json value;
  parse_override_value(parse_override("a.b=" + text), value);
  return value;
}

std::string override_error(const std::string& argument) {
  try {
    json value;
    parse_override_value(parse_override(argument), value);
  } catch (const StudyError& error) {
    return error.what();
  }
  return "";
}

TEST(TomlSourceTest, AnOverrideIsATomlValueOrABareWord) {
  EXPECT_EQ(override_value("50"), 50);
  EXPECT_TRUE(override_value("50").is_number_integer());
  EXPECT_TRUE(override_value("5e1").is_number_float());
  EXPECT_EQ(override_value("true"), true);
  EXPECT_EQ(override_value("\"50\""), "50");
  EXPECT_EQ(override_value("arrival"), "arrival");
  EXPECT_EQ(override_value("top_down-2.x"), "top_down-2.x");
  EXPECT_EQ(override_value("[.5]"s.replace(1, 1, "0.")), json({0.5}));
  EXPECT_EQ(override_value("{c = 1, d.e = 2}"), json::parse(R"({"c":1,"d":{"e":2}})"));
  EXPECT_EQ(parse_override("a.b-c.d_1=x=y").key, (std::vector<std::string>{"a", "b-c", "d_1"}));
}

TEST(TomlSourceTest, ABadOverrideSaysWhereItComesFrom) {
  EXPECT_THAT(override_error("study.rollouts"), StartsWith("--set: study.rollouts: must be KEY="));
  EXPECT_THAT(override_error("=5"), StartsWith("--set: =5: must be KEY=VALUE"));
  EXPECT_THAT(override_error("a..b=5"), StartsWith("--set: a..b=5: must be KEY=VALUE"));
  EXPECT_THAT(override_error("a=[1, 2"), StartsWith("--set: a = [1, 2: "));
  EXPECT_THAT(override_error("a="), StartsWith("--set: a: "));
  EXPECT_EQ(override_error("a=1\nb=2"), "--set: a: must be a single TOML value");
  EXPECT_EQ(override_error("a=inf"), "--set: a = inf: must be a finite number");
  EXPECT_EQ(override_error("a=\xff"), "--set: a: must be UTF-8 text");
  EXPECT_EQ(override_error("a=" + repeated("[", 100'000)), "--set: a: must be a single TOML value");
}

TEST(TomlSourceTest, WrittenTomlReadsBackToTheSame) {
  const json document = {
      {"a", 1},
      {"b", 1.0},
      {"c", 1.0 / 3},
      {"d", 1e-300},
      {"e", 1e22},
      {"f", -0.0},
      {"g", std::int64_t{1} << 62},
      {"h", "quote \" backslash \\ line\n tab\t del\x7f esc\x1b \u00e4 \U0001F600"},
      {"i", {1, 2.5, "x", {true, json::array()}, {{"k", 1}, {"l m", {{"n", 0.1}}}}}},
      {"j", {{"empty", json::object()}, {"k.l", {{"m", 1}}}, {"", 5}}},
  };
  std::string text;
  append_toml(document, "", text);
  EXPECT_EQ(content_of(text).dump(), document.dump()) << text;
}

}  // namespace
}  // namespace treeroll
