#include "learner/fit/demonstration_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "common/base/config_error.h"
#include "common/base/content_hash.h"
#include "common/policy/policy.h"
#include "common/settings/settings_reader.h"
#include "learner/fit/csv_demonstration.h"
#include "learner/fit/fit_tree.h"
#include "learner/fit/kmeans.h"
#include "learner/fit/start_policy.h"
#include "tests/fit/start_tree.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

/// A demonstration of two outputs over time, in a file.
class DemonstrationSettingsTest : public ::testing::Test {
 protected:
  DemonstrationSettingsTest() { write("t,x,still,y\n"); }

  void write(const std::string& head) {
    std::ostringstream file;
    file << head;
    for (int i = 0; i < 40; ++i) file << i << ',' << i % 7 << ",1," << 3 * i + i % 5 << '\n';
    text_ = file.str();
  }

  json demonstration() const {
    return {{"kind", "csv"}, {"files", {path_}}, {"inputs", {"t"}}, {"outputs", {"y", "x"}}};
  }

  StartPolicy start(const json& table, json* resolved_out = nullptr) const {
    json resolved;
    SettingsReader reader(table, "policy", resolved);
    StartPolicy policy = read_start_policy(reader, {.read_file = reader_of_files()});
    reader.finish();
    if (resolved_out) *resolved_out = resolved;
    return policy;
  }

  std::string error_of(const json& demonstration) const {
    try {
      start({{"model", "flat"}, {"components", {2}}, {"demonstration", demonstration}});
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }

  /// One file, without a disk.
  FileReader reader_of_files() const {
    return [this](const std::string& file) {
      if (file != path_) throw DemonstrationError(file + ": is no file");
      return text_;
    };
  }

  const std::string path_ = "demo.csv";
  std::string text_;
};

TEST_F(DemonstrationSettingsTest, FitsTheColumnsOfFiles) {
  json resolved;
  const StartPolicy policy = start({{"model", "flat"},
                                    {"components", {3}},
                                    {"demonstration", demonstration()},
                                    {"layout", "reduced_pourahmadi"}},
                                   &resolved);
  EXPECT_EQ(tree_policy(policy).layout(), ThetaLayout::kReducedPourahmadi);
  EXPECT_EQ(tree_of(policy).input_dim(), 1);
  EXPECT_EQ(tree_of(policy).dim(), 3);
  const double variance_t = (40. * 40 - 1) / 12;
  EXPECT_NEAR(resolved["fit"]["regularisation"][0], 1e-4 * variance_t, 1e-12);
  // The slope of y over t is 3, but for a ripple.
  const Component component = tree_of(policy).finest()[1];
  EXPECT_NEAR(component.covariance(1, 0) / component.covariance(0, 0), 3, .3);
  const StartPolicy again = start(resolved);
  EXPECT_EQ(to_json(*again.policy), to_json(*policy.policy));
}

TEST_F(DemonstrationSettingsTest, AStartByKmeansIsTheFitFromItsClusters) {
  json table = {
      {"model", "flat"},
      {"components", {3}},
      {"demonstration", demonstration()},
      {"fit", {{"start", "kmeans"}, {"kmeans_seed", 5}, {"iterations", 0}, {"refine", "none"}}}};
  const StartPolicy policy = start(table);
  json resolved;
  const json files = demonstration();
  const Demonstration data =
      read_demonstration(SettingsReader(files, "d", resolved), {.read_file = reader_of_files()});
  const Gmm clusters = kmeans(data.data, 1, 3, 5, data.regularisation);
  EXPECT_EQ(test::distance(tree_of(policy).finest(), clusters), 0);
  table["fit"]["iterations"] = 50;
  EXPECT_GE(mean_log_likelihood(tree_of(start(table)).finest(), data.data),
            mean_log_likelihood(clusters, data.data) - .01);
  table["fit"]["initial_output_deviation"] = 3;
  EXPECT_THROW(start(table), ConfigError);
}

/// One movement, shown twice as fast and later the second time.
TEST_F(DemonstrationSettingsTest, SeveralFilesAreAlignedAsTheStudySays) {
  std::map<std::string, std::string> files = {{"slow.csv", "t,x\n"}, {"fast.csv", "t,x\n"}};
  for (int i = 0; i <= 40; ++i) {
    const std::string x = std::to_string(std::sin(.1 * i));
    files["slow.csv"] += std::to_string(i) + "," + x + "\n";
    files["fast.csv"] += std::to_string(100 + .5 * i) + "," + x + "\n";
  }
  const auto read = [&](const json& table) {
    json resolved;
    return read_demonstration(
        SettingsReader(table, "d", resolved),
        {.read_file = [&](const std::string& file) { return files.at(file); }});
  };
  json table = {
      {"kind", "csv"}, {"files", {"slow.csv", "fast.csv"}}, {"inputs", {"t"}}, {"outputs", {"x"}}};
  EXPECT_EQ(read(table).data(0, 41), 100) << "without a word they stay as they are";
  for (const char* align : {"duration", "dynamic_time_warping"}) {
    table["align"] = align;
    const Demonstration aligned = read(table);
    EXPECT_LT((aligned.data.leftCols(41) - aligned.data.rightCols(41)).norm(), 1e-9) << align;
    EXPECT_NEAR(aligned.data(0, 0), 50, 1e-9);
    EXPECT_NEAR(aligned.data(0, 40), 80, 1e-9);
    EXPECT_NE(aligned.text.find("\n80,"), std::string::npos) << "what is stored is what came of it";
  }
  const auto error = [&](const json& settings) -> std::string {
    try {
      read(settings);
    } catch (const ConfigError& refused) {
      return refused.what();
    }
    return "";
  };
  json one = table;
  one["files"] = {"slow.csv"};
  EXPECT_THAT(error(one), HasSubstr("d.align = \"dynamic_time_warping\": aligns several files"));
  table["align"] = "by_eye";
  EXPECT_THAT(error(table), HasSubstr("d.align = \"by_eye\": must be one of"));
  table["align"] = "duration";
  files["fast.csv"] = "t,x\n1,2\n3,4\n2,5\n";
  EXPECT_THAT(error(table), HasSubstr("fast.csv: column \"t\" falls from 3 to 2 at observation 3"));
  files["fast.csv"] = "t,x\n1,2\n1,4\n";
  EXPECT_THAT(error(table), HasSubstr("fast.csv: column \"t\" does not vary"));
  files["slow.csv"] = files["fast.csv"] = "t,y,x\n1,2,3\n3,4,5\n";
  table["inputs"] = {"t", "y"};
  EXPECT_THAT(error(table), HasSubstr("d.align = \"duration\": aligns over the time"));
}

TEST_F(DemonstrationSettingsTest, OutputsMayBeMissingWhereTheStudySaysSo) {
  std::ostringstream file;
  file << "t,x,y\n";
  for (int i = 0; i < 60; ++i) {
    file << i << ',';
    if (i % 5 != 0) file << std::sin(.1 * i);
    file << ',';
    if (i < 20 || i > 30 || i % 5 == 0) file << 3 * std::sin(.1 * i) + std::cos(.3 * i);
    file << '\n';
  }
  text_ = file.str();
  json table = {{"model", "flat"}, {"components", {3}}, {"demonstration", demonstration()}};
  EXPECT_THAT(error_of(table["demonstration"]),
              HasSubstr("demo.csv:2: column \"x\" is \"\": must be a finite number"));
  table["demonstration"]["missing_outputs"] = true;
  json resolved;
  const StartPolicy policy = start(table, &resolved);
  EXPECT_TRUE(resolved["demonstration"]["missing_outputs"]);
  EXPECT_TRUE(std::isfinite(policy.log_likelihoods[0]));
  // The data that a resolved study holds have the same gaps, and give the same fit.
  const CsvDemonstration again =
      read_demonstration_text(policy.demonstration_text,
                              to_hex(content_hash(policy.demonstration_text)), {"t", "y", "x"}, 1);
  EXPECT_TRUE(((again.data.array() == policy.demonstration->array()) ||
               (again.data.array().isNaN() && policy.demonstration->array().isNaN()))
                  .all());
  EXPECT_EQ(again.data.array().isNaN().count(), 12 + 8);

  const auto refused = [&](const std::string& text, const char* fit_start) -> std::string {
    text_ = text;
    table["fit"]["start"] = fit_start;
    try {
      start(table);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refused(text_, "kmeans"),
              HasSubstr("policy.fit.start = \"kmeans\": of clusters needs all outputs"));
  EXPECT_THAT(refused("t,x,y\n0,,\n1,2,3\n2,3,4\n", "equally_spaced"),
              HasSubstr("demo.csv:2: has no output"));
  EXPECT_THAT(refused("t,x,y\n0,1,\n1,2,\n2,3,\n", "equally_spaced"),
              HasSubstr("column \"y\" of the files has no number"));
  EXPECT_THAT(refused("t,x,y\n,1,2\n1,2,3\n2,3,4\n", "equally_spaced"),
              HasSubstr("demo.csv:2: column \"t\" is \"\": must be a finite number"));
}

TEST_F(DemonstrationSettingsTest, SeveralInputsFitATree) {
  json files = demonstration();
  files["inputs"] = {"t", "x"};
  files["outputs"] = {"y"};
  const StartPolicy policy = start({{"components", {1, 2}}, {"demonstration", files}});
  EXPECT_EQ(tree_of(policy).input_dim(), 2);
  EXPECT_EQ(tree_of(policy).num_layers(), 2);
}

TEST_F(DemonstrationSettingsTest, AConstantOutputTakesTheVarianceThatIsGiven) {
  const std::vector<std::vector<std::string>> choices = {{"still", "y"}, {"still"}};
  for (const std::vector<std::string>& outputs : choices) {
    for (const char* start_of_em : {"equally_spaced", "kmeans"}) {
      json files = demonstration();
      files["outputs"] = outputs;
      const std::vector<double> variances(1 + outputs.size(), 1e-3);
      json table;
      table["components"] = {2, 4};
      table["demonstration"] = files;
      table["fit"]["regularisation"] = variances;
      table["fit"]["start"] = start_of_em;
      json resolved;
      const StartPolicy policy = start(table, &resolved);
      const Gmm finest = tree_of(policy).finest();
      for (const Component& component : finest.components()) {
        EXPECT_NEAR(component.mean[1], 1, 1e-12);
        EXPECT_NEAR(component.covariance(1, 1), 1e-3, 1e-12);
      }
      EXPECT_EQ(to_json(*start(resolved).policy), to_json(*policy.policy));
    }
  }
}

TEST_F(DemonstrationSettingsTest, AComponentWithoutDataNamesTheCure) {
  text_ = "t,y\n0,0\n1e-9,1\n1,2\n";
  json table;
  table["model"] = "flat";
  table["components"] = {3};
  table["demonstration"] = demonstration();
  table["demonstration"]["outputs"] = {"y"};
  table["fit"]["regularisation"] = {1e-12, 1e-12};
  try {
    start(table);
    FAIL() << "it has data for each component";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("is left without data"));
    EXPECT_THAT(error.what(), HasSubstr("with policy.fit.start = \"kmeans\""));
  }
  // It is none where the variances are at fault.
  table["fit"]["regularisation"] = {0, 0};
  try {
    start(table);
    FAIL() << "it has a covariance for each component";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("must be positive definite"));
    EXPECT_THAT(error.what(), testing::Not(HasSubstr("kmeans")));
  }
}

TEST_F(DemonstrationSettingsTest, RefusesFilesThatHaveChangedSinceTheyWereResolved) {
  json resolved;
  start({{"model", "flat"}, {"components", {2}}, {"demonstration", demonstration()}}, &resolved);
  EXPECT_EQ(error_of(resolved["demonstration"]), "");
  write("t,x,still,y\n99,1,1,1\n");
  EXPECT_THAT(error_of(resolved["demonstration"]), HasSubstr("policy.demonstration.content = "));
  EXPECT_THAT(error_of(resolved["demonstration"]), HasSubstr("the files have changed"));
}

TEST_F(DemonstrationSettingsTest, RefusesWhatCannotBeReadNamingKeyFileLineAndColumn) {
  const auto with = [this](const char* key, const json& value) {
    json changed = demonstration();
    changed[key] = value;
    return error_of(changed);
  };
  EXPECT_THAT(with("files", json::array()), HasSubstr("policy.demonstration.files"));
  EXPECT_THAT(with("files", {"/nowhere.csv"}), HasSubstr("/nowhere.csv: is no file"));
  EXPECT_THAT(with("inputs", {"z"}), HasSubstr(path_ + ":1: has no column \"z\""));
  EXPECT_THAT(with("outputs", {"t"}), HasSubstr("policy.demonstration.outputs"));
  EXPECT_THAT(with("outputs", {"x", "x"}), HasSubstr("policy.demonstration.outputs"));
  EXPECT_THAT(with("inputs", {"still"}), HasSubstr("column \"still\" of the files does not vary"));
  EXPECT_THAT(with("outputs", {"still"}),
              HasSubstr("policy.fit.regularisation: output 1 of the demonstration does not vary"));
  EXPECT_THAT(with("samples", 3), HasSubstr("policy.demonstration.samples"));
  write("t,x,still,y\n1,2,3,four\n");
  EXPECT_THAT(error_of(demonstration()), HasSubstr(path_ + ":2: column \"y\" is \"four\""));
}

}  // namespace
}  // namespace treeroll
