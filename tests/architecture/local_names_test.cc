#include <gmock/gmock.h>

#include <string>

#include "tests/architecture/rules.h"

namespace treeroll::architecture {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// What is found in two sources of these folders, the first with an `open` of its own.
std::vector<std::string> found_beside_open(const std::string& second_path,
                                           const std::string& second,
                                           const std::string& around = "namespace {\n") {
  const std::string end = "}  // namespace\n";
  std::vector<std::string> messages;
  for (const Finding& finding : check_local_names(
           {make_source_file("sim/a.cc", "namespace {\nbool open(int door) {\n" + end),
            make_source_file(second_path, around + second + end)})) {
    messages.push_back(to_string(finding));
  }
  return messages;
}

TEST(LocalNamesTest, ANameThatTwoSourcesOfAFolderGiveIsFound) {
  for (const char* taken :
       {"bool open(double door) {\n", "constexpr int open = 3;\n", "struct open {\n",
        "class open : public Door {\n", "const std::map<int, bool> open{{1, true}};\n",
        "std::vector<int>* open();\n", "int open[] = {1};\n"}) {
    EXPECT_THAT(found_beside_open("sim/b.cc", taken),
                ElementsAre(AllOf(HasSubstr("sim/b.cc:2: 'open'"), HasSubstr("sim/a.cc"))))
        << taken;
  }
}

TEST(LocalNamesTest, OtherNamesPass) {
  for (const char* other :
       {"bool opened(int door) {\n", "  open(3);\n", "// bool open(int door)\n",
        "const char* text = \"bool open(int)\";\n", "using open = int;\n", "TEST(Sim, open) {\n"}) {
    EXPECT_THAT(found_beside_open("sim/b.cc", other), IsEmpty()) << other;
  }
}

TEST(LocalNamesTest, OtherFoldersAndNamedNamespacesPass) {
  EXPECT_THAT(found_beside_open("sim/plants/b.cc", "bool open(int door) {\n"), IsEmpty());
  EXPECT_THAT(found_beside_open("sim/b.cc", "bool open(int door) {\n", "namespace sim {\n"),
              IsEmpty());
}

}  // namespace
}  // namespace treeroll::architecture
