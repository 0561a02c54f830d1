#include "learner/study/study_source.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "learner/study/setting_overlay.h"
#include "tests/study/study_text.h"

namespace treeroll {
namespace {

using nlohmann::json;
using study_test::error_of;
using study_test::StudyText;

constexpr std::string_view kBase = R"([study]
name = "base"
rollouts = 400
[task.goal]
outputs = [1, 2]
[[axes]]
name = "models"
options = [{name = "flat"}, {name = "tree"}]
[[axes]]
key = "study.rollouts"
values = [100, 200]
)";

/// study.toml with `text`, beside base.toml.
class StudyBesideItsBase : public StudyText {
 public:
  StudyBesideItsBase(std::string_view text, std::string_view base = kBase) : StudyText(text) {
    std::ofstream(folder() / "base.toml") << base;
  }
};

struct Source {
  json content;
  SettingOrigins origins;
};

Source read(const StudyText& file) {
  Source source;
  source.origins = read_study_source(file.path(), source.content);
  return source;
}

std::string refused(const StudyText& file) {
  json content;
  return error_of(file, [&](const auto& path) { read_study_source(path, content); });
}

TEST(StudySourceTest, TheExtendingFilesKeysWinAndTheOthersStay) {
  const StudyBesideItsBase file(
      "extends = \"base.toml\"\n[study]\nname = \"own\"\n[task.goal]\npsi = [3]\n");
  const Source source = read(file);
  EXPECT_EQ(source.content.at("study"), json::parse(R"({"name":"own","rollouts":400})"));
  EXPECT_EQ(source.content.at("task"), json::parse(R"({"goal":{"outputs":[1,2],"psi":[3]}})"));
  EXPECT_FALSE(source.content.contains("extends"));
  EXPECT_EQ(file.shortened(origin_of(source.origins, "study.name")), "FILE:3");
  EXPECT_EQ(origin_of(source.origins, "study.rollouts"),
            (file.folder() / "base.toml").string() + ":3");
  EXPECT_EQ(file.shortened(origin_of(source.origins, "")), "FILE");
}

TEST(StudySourceTest, AnAxisOfTheSameNameIsReplacedAndOthersFollow) {
  const StudyBesideItsBase file(R"(extends = "base.toml"
[[axes]]
key = "task.alpha"
values = [1, 5]
[[axes]]
name = "models"
options = [{name = "tree"}]
)");
  const Source source = read(file);
  const json& axes = source.content.at("axes");
  ASSERT_EQ(axes.size(), 3u);
  EXPECT_EQ(axes[0].at("options"), json::parse(R"([{"name":"tree"}])"));
  EXPECT_EQ(axes[1].at("key"), "study.rollouts");
  EXPECT_EQ(axes[2].at("key"), "task.alpha");
  EXPECT_EQ(file.shortened(origin_of(source.origins, "axes[0].options[0].name")), "FILE:7");
  EXPECT_EQ(file.shortened(origin_of(source.origins, "axes[2].key")), "FILE:3");
  EXPECT_EQ(origin_of(source.origins, "axes[0].options[1].name"),
            origin_of(source.origins, "axes[0].options"))
      << "the base's second option has left no trace";
}

TEST(StudySourceTest, AChainOfFilesIsOneStudy) {
  const StudyBesideItsBase file("extends = \"middle.toml\"\n[study]\nseed = 3\n");
  std::ofstream(file.folder() / "middle.toml")
      << "extends = \"base.toml\"\n[study]\nrollouts = 50\n";
  EXPECT_EQ(read(file).content.at("study"),
            json::parse(R"({"name":"base","rollouts":50,"seed":3})"));
}

TEST(StudySourceTest, RefusesWhatCannotBeExtended) {
  EXPECT_EQ(refused(StudyBesideItsBase("extends = 7\n")), "FILE:1: extends = 7: must be a string");
  EXPECT_EQ(refused(StudyBesideItsBase("\nextends = \"study.toml\"\n")),
            "FILE:2: extends = \"study.toml\": is one file too many: must be at most 8, each "
            "extending the next; do they extend each other?");
  const StudyBesideItsBase missing("extends = \"nowhere.toml\"\n");
  EXPECT_EQ(refused(missing), (missing.folder() / "nowhere.toml").string() + ": no such file");
  const StudyBesideItsBase broken("extends = \"base.toml\"\n", "[study\n");
  EXPECT_NE(refused(broken).find("base.toml:1"), std::string::npos) << refused(broken);
}

}  // namespace
}  // namespace treeroll
