#include "common/program/program_command.h"

#include <gmock/gmock.h>

#include <cstdlib>

#include "common/base/config_error.h"

namespace treeroll {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string refusal_of(const std::string& command) {
  try {
    read_program_command("--evaluator", command);
    return "";
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.key(), "--evaluator");
    EXPECT_EQ(error.value(), command);
    return error.rule();
  }
}

TEST(ProgramCommandTest, HasTheWordsThatAShellWouldHave) {
  setenv("TREEROLL_TEST_WORD", "two words", 1);
  EXPECT_THAT(
      read_program_command("--evaluator", R"(sh -c 'a; b' "one $TREEROLL_TEST_WORD" back\ slash)"),
      ElementsAre("sh", "-c", "a; b", "one two words", "back slash"));
}

TEST(ProgramCommandTest, RefusesWhatItCannotStartAndSaysWhy) {
  EXPECT_THAT(refusal_of(""), HasSubstr("must name a program"));
  EXPECT_THAT(refusal_of("  "), HasSubstr("must name a program"));
  EXPECT_THAT(refusal_of("treeroll-nobody x"), HasSubstr("can be executed"));
  EXPECT_THAT(refusal_of("/etc/passwd"), HasSubstr("can be executed"));
  EXPECT_THAT(refusal_of("/tmp"), HasSubstr("can be executed"));
  EXPECT_THAT(refusal_of("sh | sh"), HasSubstr("sh -c"));
  EXPECT_THAT(refusal_of("sh 'a"), HasSubstr("must be a program"));
  EXPECT_THAT(refusal_of("$(sh)"), HasSubstr("sh -c"));
  EXPECT_THAT(refusal_of("sh $TREEROLL_NOBODY_SETS_THIS"), HasSubstr("variable"));
}

}  // namespace
}  // namespace treeroll
