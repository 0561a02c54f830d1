#include "tests/architecture/rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

/// Each rule is shown sources that break it and sources that only look like it: a rule that finds
/// nothing in the tree must be known to find something elsewhere.
namespace treeroll::architecture {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::vector<std::string> findings(const std::string& path, const std::string& text) {
  std::vector<std::string> messages;
  for (const Finding& finding : check_tree({make_source_file(path, text)})) {
    messages.push_back(to_string(finding));
  }
  return messages;
}

TEST(IncludeRulesTest, WhatAPolicyIsMadeOfIsItsKindsBusiness) {
  const std::string text = "#include \"common/policy/tree/tree_model.h\"\n";
  for (const char* file : {"workers/app/a.cc", "learner/explore/a.cc", "learner/study/a.cc"}) {
    EXPECT_THAT(findings(file, text), ElementsAre(HasSubstr("use Policy"))) << file;
  }
  EXPECT_THAT(findings("learner/fit/a.cc", text), IsEmpty());
}

TEST(IncludeRulesTest, AnIncludeAgainstAnArrowIsFoundWithFileLineAndWhatIsAllowed) {
  EXPECT_THAT(findings("sim/a.cc", "#include <vector>\n#include \"common/mixture/gmm.h\"\n"),
              ElementsAre(AllOf(HasSubstr("sim/a.cc:2: "), HasSubstr("common/mixture"),
                                HasSubstr("common/base, common/numbers, common/settings, sim"))));
}

TEST(IncludeRulesTest, LearnerAndWorkersAreKeptApart) {
  EXPECT_THAT(findings("learner/app/a.cc", "#include \"workers/tasks/task.h\"\n"),
              ElementsAre(HasSubstr("may not include workers/tasks")));
  EXPECT_THAT(findings("workers/app/a.cc", "#include \"learner/core/study.h\"\n"),
              ElementsAre(HasSubstr("may not include learner/core")));
}

TEST(IncludeRulesTest, IncludesAlongOneOrSeveralArrowsPass) {
  EXPECT_THAT(findings("learner/app/a.cc",
                       "#include \"common/base/check.h\"\n#include \"learner/fit/em.h\"\n"
                       "#include \"common/transport/bus.h\"\n#include \"learner/app/b.h\"\n"),
              IsEmpty());
}

TEST(IncludeRulesTest, TestsMayIncludeAnything) {
  EXPECT_THAT(findings("tests/sim/a_test.cc",
                       "#include \"learner/core/study.h\"\n#include <lcm/lcm-cpp.hpp>\n"),
              IsEmpty());
}

TEST(IncludeRulesTest, AnIncludeThatDoesNotStartAtTheRootIsFound) {
  EXPECT_THAT(findings("sim/a.cc", "#include \"a.h\"\n"), ElementsAre(HasSubstr("from the root")));
}

TEST(IncludeRulesTest, LcmAndItsTypesBelongToTransport) {
  for (const std::string include : {"<lcm/lcm-cpp.hpp>", "\"treeroll/reward_batch_t.hpp\""}) {
    EXPECT_THAT(findings("learner/app/a.cc", "#include " + include + "\n"),
                ElementsAre(HasSubstr("common/transport alone")));
    EXPECT_THAT(findings("common/transport/a.cc", "#include " + include + "\n"), IsEmpty());
  }
}

TEST(IncludeRulesTest, AHeaderOfAnotherLibraryWithASimilarNamePasses) {
  EXPECT_THAT(
      findings("learner/report/a.cc", "#include <boost/math/distributions/students_t.hpp>\n"),
      IsEmpty());
}

TEST(IncludeRulesTest, OdeBelongsToSim) {
  EXPECT_THAT(findings("workers/tasks/a.cc", "#include <ode/ode.h>\n"),
              ElementsAre(HasSubstr("sim alone")));
  EXPECT_THAT(findings("sim/a.cc", "#include <ode/ode.h>\n"), IsEmpty());
}

TEST(IncludeRulesTest, OptionsAndTheSinkOfTheLogBelongToProgram) {
  for (const std::string include : {"<CLI/CLI.hpp>", "<spdlog/sinks/stdout_color_sinks.h>"}) {
    EXPECT_THAT(findings("learner/app/a.cc", "#include " + include + "\n"),
                ElementsAre(HasSubstr("common/program/program.h")));
    EXPECT_THAT(findings("common/program/a.cc", "#include " + include + "\n"), IsEmpty());
  }
  EXPECT_THAT(findings("learner/app/a.cc", "#include <spdlog/spdlog.h>\n"), IsEmpty());
}

TEST(IncludeRulesTest, AHeavyLibraryIsFoundInAHeaderOnly) {
  const std::string include = "#include <nlohmann/json.hpp>\n";
  EXPECT_THAT(findings("workers/app/a.h", "#pragma once\n" + include),
              ElementsAre(HasSubstr("json_fwd")));
  EXPECT_THAT(findings("workers/app/a.cc", include), IsEmpty());
}

TEST(IncludeRulesTest, DiskAndNetworkAreFoundInACoreOnly) {
  EXPECT_THAT(findings("learner/core/a.cc", "#include <fstream>\n"),
              ElementsAre(HasSubstr("effects")));
  EXPECT_THAT(findings("learner/app/a.cc", "#include <fstream>\n"), IsEmpty());
}

TEST(IncludeRulesTest, ASourceThatDoesNotIncludeItsOwnHeaderFirstIsFound) {
  const SourceFile header = make_source_file("sim/a.h", "#pragma once\n");
  const auto check = [&](const std::string& path, const std::string& text) {
    return check_own_headers({header, make_source_file(path, text)});
  };
  for (const std::string text : {"#include <vector>\n\n#include \"sim/a.h\"\n", "int a;\n"}) {
    ASSERT_EQ(check("sim/a.cc", text).size(), 1U);
    EXPECT_THAT(to_string(check("sim/a.cc", text)[0]),
                HasSubstr("sim/a.cc:1: include \"sim/a.h\" first"));
  }
  EXPECT_TRUE(check("sim/a.cc", "// why\n#include \"sim/a.h\"\n#include <vector>\n").empty());
  EXPECT_TRUE(check("sim/b.cc", "#include <vector>\n").empty()) << "it has no header";
  EXPECT_TRUE(check("tests/sim/a_test.cc", "#include <vector>\n").empty());
}

TEST(IncludeRulesTest, AnIncludeInACommentOrALiteralDoesNotCount) {
  EXPECT_THAT(findings("sim/a.cc",
                       "// #include \"learner/core/study.h\"\n/*\n#include \"learner/core/a.h\"\n"
                       "*/\nconst char* text = R\"(\n#include \"learner/core/a.h\"\n)\";\n"),
              IsEmpty());
}

struct Planted {
  std::string line;
  std::string advice;
};

void PrintTo(const Planted& planted, std::ostream* out) { *out << planted.line; }

class CoreWordsTest : public ::testing::TestWithParam<Planted> {};

TEST_P(CoreWordsTest, IsFoundInACoreWithItsReplacementAndNotInADaemon) {
  EXPECT_THAT(findings("learner/core/a.cc", "\n" + GetParam().line + "\n"),
              ElementsAre(AllOf(HasSubstr("learner/core/a.cc:2: "), HasSubstr(GetParam().advice))));
  EXPECT_THAT(findings("learner/app/a.cc", GetParam().line + "\n"), IsEmpty());
  EXPECT_THAT(findings("learner/core/a.cc", "// " + GetParam().line + "\n"), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    Planted, CoreWordsTest,
    ::testing::Values(Planted{"auto t = std::chrono::steady_clock::now();", "TimePoint"},
                      Planted{"auto t = std::time(nullptr);", "TimePoint"},
                      Planted{"clock_gettime(CLOCK_MONOTONIC, &t);", "TimePoint"},
                      Planted{"std::random_device device;", "RandomStream"},
                      Planted{"std::mt19937_64 engine(seed);", "RandomStream"},
                      Planted{"int die = rand() % 6;", "RandomStream"},
                      Planted{"std::normal_distribution<double> noise;", "RandomStream"},
                      Planted{"std::shuffle(begin, end, engine);", "RandomStream"},
                      Planted{"std::unordered_map<int, int> leases;", "std::map"},
                      Planted{"std::thread thread([] {});", "one thread"},
                      Planted{"std::atomic<int> count;", "one thread"},
                      Planted{"  #pragma omp parallel for", "one thread"}));

TEST(WordRulesTest, WordsThatOnlyResembleForbiddenOnesPass) {
  EXPECT_THAT(findings("learner/core/a.cc",
                       "Duration time(int run);\nint operand(1);\nauto n = ledger.samples();\n"
                       "const char* text = \"std::thread\";\nint separated = 65'000;  // '\n"),
              IsEmpty());
}

TEST(WordRulesTest, APlantMayNotDrawAtRandomButMayKnowThreads) {
  EXPECT_THAT(findings("sim/a.cc", "std::mt19937 engine;\n"),
              ElementsAre(HasSubstr("RandomStream")));
  EXPECT_THAT(findings("sim/a.cc", "thread_local int report = 0;\n"), IsEmpty());
}

TEST(WordRulesTest, TheLibrarysElementaryFunctionsAreFoundWhereBitsCount) {
  for (const std::string call : {"std::exp(x)", "sin(x)", "-pow(x, 2.0)", "array.exp()"}) {
    EXPECT_THAT(findings("learner/explore/a.cc", "double y = " + call + ";\n"),
                ElementsAre(HasSubstr("elementary.h")))
        << call;
    EXPECT_THAT(findings("learner/report/a.cc", "double y = " + call + ";\n"), IsEmpty()) << call;
  }
  EXPECT_THAT(findings("learner/explore/a.cc",
                       "double y = elementary::exp(x) + std::sqrt(x) + std::abs(x);\n"),
              IsEmpty());
}

TEST(ProjectRulesTest, AHeaderWithoutPragmaOnceIsFound) {
  EXPECT_THAT(findings("sim/a.h", "// Plant.\nint f();\n"),
              ElementsAre(HasSubstr("sim/a.h:2: a header begins")));
  EXPECT_THAT(findings("sim/a.h", ""), ElementsAre(HasSubstr("a header begins")));
  EXPECT_THAT(findings("sim/a.h", "// Plant.\n#pragma once\n"), IsEmpty());
}

TEST(ProjectRulesTest, WordsLeftBehindAreFoundInAnyTextFile) {
  EXPECT_THAT(findings("deploy/README.md", "text\n- TODO: the rest\n"),
              ElementsAre(HasSubstr("deploy/README.md:2: finish it")));
  EXPECT_THAT(findings("sim/a.cc", "int x = 1;  // FIXME\n"), ElementsAre(HasSubstr("finish it")));
}

TEST(ProjectRulesTest, NamesOfThingsOutsideTheTreeAreFound) {
  EXPECT_THAT(findings("sim/a.cc", "// see ../shared/x\n"), ElementsAre(HasSubstr("alone")));
  EXPECT_THAT(findings("sim/README.md", "see DESIGN.md\n"), ElementsAre(HasSubstr("alone")));
}

TEST(ProjectRulesTest, FileNamesThatSayNothingAreFound) {
  EXPECT_THAT(findings("learner/core/string_utils.cc", ""),
              ElementsAre(HasSubstr("name the file")));
  EXPECT_THAT(findings("common/base/CamelCase.cc", ""), ElementsAre(HasSubstr("snake_case")));
}

TEST(ProjectRulesTest, AFileThatIsTooLongIsFound) {
  const auto lines = [](int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += "int f();\n";
    return text;
  };
  EXPECT_THAT(findings("sim/a.cc", lines(401)), ElementsAre(HasSubstr("split the file")));
  EXPECT_THAT(findings("sim/a.cc", lines(400)), IsEmpty());
}

TEST(ProjectRulesTest, GlobsAndFlagsThatChangeResultsAreFoundInCMakeFiles) {
  EXPECT_THAT(findings("sim/CMakeLists.txt", "file(GLOB sources *.cc)\n"),
              ElementsAre(HasSubstr("glob")));
  EXPECT_THAT(findings("sim/CMakeLists.txt", "# not -ffast-math\nset(flags -ffast-math)\n"),
              ElementsAre(HasSubstr("sim/CMakeLists.txt:2: this flag")));
}

TEST(ArrowRulesTest, AnArrowThatNothingUsesIsFound) {
  const auto unused = [](const std::string& text) {
    std::vector<std::string> messages;
    for (const Finding& finding : check_unused_arrows({make_source_file("sim/a.cc", text)})) {
      messages.push_back(to_string(finding));
    }
    return messages;
  };
  const auto arrow = HasSubstr("nothing in sim includes common/numbers");
  EXPECT_THAT(unused("#include <cmath>\n"), Contains(arrow));
  EXPECT_THAT(unused("#include \"common/numbers/lanes.h\"\n"), Not(Contains(arrow)));
}

TEST(LinkRulesTest, ALinkAgainstAnArrowIsFound) {
  const std::vector<SourceFile> files = {
      make_source_file("sim/CMakeLists.txt",
                       "add_library(treeroll_sim STATIC a.cc)\n"
                       "target_link_libraries(treeroll_sim\n  PUBLIC treeroll_options\n"
                       "  PRIVATE treeroll_policy treeroll_base)\n"),
      make_source_file("common/policy/CMakeLists.txt", "add_library(treeroll_policy gmm.cc)\n"),
      make_source_file("common/base/CMakeLists.txt", "add_library(treeroll_base check.cc)\n"),
  };
  const std::vector<Finding> found = check_links(files);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(to_string(found[0]),
              AllOf(HasSubstr("sim/CMakeLists.txt:2: "), HasSubstr("treeroll_policy")));
}

TEST(MessageRulesTest, ACommentBehindAFieldOfAMessageTypeIsFound) {
  EXPECT_THAT(findings("lcmtypes/a_t.lcm",
                       "struct a_t {\n  // first; then more // of it\n  int32_t a;\n"
                       "  int32_t b;  // behind\n}\n"),
              ElementsAre(AllOf(HasSubstr("a_t.lcm:4: "), HasSubstr("line above"))));
}

}  // namespace
}  // namespace treeroll::architecture
