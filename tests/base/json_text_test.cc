#include "common/base/json_text.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

namespace treeroll {
namespace {

TEST(ParseJsonTest, ReadsWhatIsNestedAsDeepAsAllowed) {
  const Result<nlohmann::json> value = parse_json(R"({"a": [1, {"b": []}]})", 4);
  ASSERT_TRUE(value);
  EXPECT_EQ((*value)["a"][0], 1);
}

TEST(ParseJsonTest, RefusesWhatIsNestedDeeper) {
  EXPECT_FALSE(parse_json("[[[[]]]]", 2));
  const Result<nlohmann::json> deep =
      parse_json(std::string(1'000'000, '[') + std::string(1'000'000, ']'), 64);
  ASSERT_FALSE(deep);
  EXPECT_EQ(deep.error().message, "must not be nested deeper than 64");
}

TEST(ParseJsonTest, RefusesWhatIsNoJson) {
  for (const char* text : {"", "{", "[1,]", "{\"a\": nan}", "[1] 2"}) {
    const Result<nlohmann::json> value = parse_json(text, 64);
    ASSERT_FALSE(value) << text;
    EXPECT_EQ(value.error().message, "must be JSON") << text;
  }
}

}  // namespace
}  // namespace treeroll
