#include "tests/architecture/equation_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace treeroll::architecture {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(EquationsInTest, ReadsNumbersAndRanges) {
  EXPECT_THAT(equations_in("(3-1), table 3-2, (A-9) to (A-11) and f(2-1)"),
              ElementsAre("(2-1)", "(3-1)", "(A-10)", "(A-11)", "(A-9)"));
  EXPECT_THAT(equations_in("(2-5), (A-7)"), ElementsAre("(2-5)", "(A-7)"));
  EXPECT_THAT(equations_in("Section 3-2, 4-5"), IsEmpty());
}

/// What is wrong with a map of these rows, apart from the equations it lacks.
std::vector<std::string> findings_in(const std::string& rows) {
  const std::vector<SourceFile> files = {
      make_source_file(std::string(kEquationMapPath),
                       "## Equations of the thesis\n\n|a|b|c|\n|---|---|---|\n" + rows),
      make_source_file("common/mixture/gmr.h", "// ghost\nclass Gmr {\n  void regress();\n};\n"),
      make_source_file("tests/policy/gmr_test.cc",
                       "TEST(GmrTest, IsALine) {}\nTEST_F(OtherTest,\n       IsNone) {}\n"
                       "// TEST(GhostTest, IsAComment) {}\n")};
  std::vector<std::string> messages;
  for (const Finding& finding : check_equation_map(files)) {
    if (finding.message.find("missing from the map") == std::string::npos) {
      messages.push_back(to_string(finding));
    }
  }
  return messages;
}

TEST(EquationMapTest, PassesWhatIsTrue) {
  EXPECT_THAT(findings_in("| (2-3) | `common/mixture/gmr.h` `Gmr::regress` | `GmrTest.IsALine` |\n"
                          "| (2-4) | `Gmr` | `OtherTest.*`, `.IsNone`, `GmrTest.Is*` |\n"
                          "| (2-6) | it is another policy |\n"),
              IsEmpty());
}

TEST(EquationMapTest, FindsAFileAWordAndATestThatDoNotExist) {
  EXPECT_THAT(findings_in("| (2-3) | `common/policy/old.h` `Gmr` | `GmrTest.IsALine` |\n"),
              ElementsAre(HasSubstr("learner/README.md:5: there is no file common/policy/old.h")));
  EXPECT_THAT(findings_in("| (2-3) | `common/mixture/gmr.h` `Gmr::vary` | `GmrTest.IsALine` |\n"),
              ElementsAre(HasSubstr("Gmr::vary is not in common/mixture/gmr.h")));
  EXPECT_THAT(findings_in("| (2-3) | `common/mixture/gmr.h` `ghost` | `GmrTest.IsALine` |\n"),
              ElementsAre(HasSubstr("ghost is not in")));
  for (const std::string test :
       {"GmrTest.IsAPlane", "OtherTest.IsALine", "GhostTest.*", "GmrTest.As*"}) {
    EXPECT_THAT(findings_in("| (2-3) | `common/mixture/gmr.h` `Gmr` | `" + test + "` |\n"),
                ElementsAre(HasSubstr("there is no test " + test)));
  }
}

TEST(EquationMapTest, FindsARowThatNamesNothing) {
  EXPECT_THAT(findings_in("| (2-3) | regression | `GmrTest.IsALine` |\n"),
              ElementsAre(HasSubstr("names no function")));
  EXPECT_THAT(findings_in("| (2-3) | `common/mixture/gmr.h` `Gmr` | by eye |\n"),
              ElementsAre(HasSubstr("names no test")));
  EXPECT_THAT(findings_in("| (2-3) | `common/mixture/gmr.h` `Gmr` | `IsALine` |\n"),
              ElementsAre(HasSubstr("write `Suite.Name`")));
  EXPECT_THAT(findings_in("| (2-3) |\n"), ElementsAre(HasSubstr("a row has")));
}

TEST(EquationMapTest, FindsEveryEquationThatIsMissing) {
  const auto missing = [](const std::string& rows) {
    return check_equation_map({make_source_file(
        std::string(kEquationMapPath),
        "## Equations of the thesis\n|a|b|\n|---|---|\n" + rows + "\n## Other\n| (B-7) | no |\n")});
  };
  const std::string all_but_two =
      "| (2-1) to (2-7), (3-1) to (3-13), (3-15) to (3-18) | r |\n"
      "| (4-1) to (4-7), (A-1) to (A-37), (B-1) to (B-6) | r |\n";
  const std::vector<Finding> findings = missing(all_but_two);
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_THAT(findings[0].message, HasSubstr("(3-14) is missing"));
  EXPECT_THAT(findings[1].message, HasSubstr("(B-7) is missing"));
  EXPECT_THAT(missing(all_but_two + "| (3-14), (B-7) | r |\n"), IsEmpty());
}

}  // namespace
}  // namespace treeroll::architecture
