#include "learner/fit/csv_demonstration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <utility>

namespace treeroll {
namespace {

using ::testing::HasSubstr;

std::string refusal_of_csv(const std::string& text, const std::vector<std::string>& columns) {
  try {
    parse_demonstration(text, "demo.csv", columns);
  } catch (const DemonstrationError& error) {
    return error.what();
  }
  return "";
}

std::string nothing_else(const std::string& file) {
  throw DemonstrationError(file + ": is no file");
}

/// Files by name, without a disk.
FileReader files(std::map<std::string, std::string> texts) {
  return [texts = std::move(texts)](const std::string& file) {
    const auto found = texts.find(file);
    return found == texts.end() ? nothing_else(file) : found->second;
  };
}

TEST(CsvDemonstrationTest, TakesTheNamedColumnsInTheOrderAsked) {
  const Eigen::MatrixXd data = parse_demonstration(
      "t, x,note,y\n0,1,a,2\r\n0.5, -1e-3 ,b,3\n1,7,,4", "demo.csv", {"y", "t"});
  EXPECT_EQ(data, (Eigen::MatrixXd(2, 3) << 2, 3, 4, 0, .5, 1).finished());
}

TEST(CsvDemonstrationTest, SaysFileLineAndColumnOfWhatIsWrong) {
  const std::vector<std::string> t = {"t"};
  EXPECT_EQ(refusal_of_csv("", t), "demo.csv: is empty: must begin with a line of column names");
  EXPECT_EQ(refusal_of_csv("x,y\n1,2\n", t),
            "demo.csv:1: has no column \"t\"; its columns are \"x\", \"y\"");
  EXPECT_EQ(refusal_of_csv("t,t\n1,2\n", t), "demo.csv:1: has the column \"t\" twice");
  EXPECT_EQ(refusal_of_csv("t,x\n1,2\n3\n", t),
            "demo.csv:3: has 1 columns, must have the 2 of the first line");
  for (const char* bad : {"", "abc", "+", "-", "++1", "+-1", "1e", "+inf", "1e999", "inf", "nan",
                          "-nan", "1 2", "0x10", "1e21", "1.5s"}) {
    EXPECT_THAT(refusal_of_csv(std::string("x,t\n0,1\n0,") + bad + "\n", t),
                HasSubstr("demo.csv:3: column \"t\" is \"" + std::string(bad) + "\": must be"));
  }
  const std::string binary("t\n\x01\xff\x00\n", 6);
  EXPECT_THAT(refusal_of_csv(binary, t), HasSubstr("demo.csv:2: column \"t\" is \"???\""));
  EXPECT_THAT(refusal_of_csv(std::string(5000, ','), t), HasSubstr("at most 1000 columns"));
  EXPECT_THAT(refusal_of_csv("t\n" + std::string(100000, '9') + "\n", t),
              HasSubstr("...\": must be"));
}

TEST(CsvDemonstrationTest, BlankLinesMayStandAtTheEndAlone) {
  const Eigen::MatrixXd data = (Eigen::MatrixXd(1, 2) << 1, 3).finished();
  for (const char* end : {"", "\n", "\n\n", "\r\n \t\r\n", "\n\n\n   "}) {
    EXPECT_EQ(parse_demonstration(std::string("t,x\n1,2\n3,4") + end, "demo.csv", {"t"}), data);
  }
  const std::string rule = ": is blank: only lines at the end may be";
  EXPECT_EQ(refusal_of_csv("t,x\n1,2\n\n \n3,4\n", {"t"}), "demo.csv:3" + rule);
  EXPECT_EQ(refusal_of_csv("t\n1\n\n3\n", {"t"}), "demo.csv:3" + rule);
  EXPECT_EQ(refusal_of_csv("\nt,x\n1,2\n", {"t"}), "demo.csv:1" + rule);
  EXPECT_EQ(refusal_of_csv("\n\n", {"t"}),
            "demo.csv: is empty: must begin with a line of column names");
}

TEST(CsvDemonstrationTest, TakesFieldsInQuotes) {
  const Eigen::MatrixXd data = parse_demonstration(
      "\xef\xbb\xbf\"t\", \"x, \"\"cm\"\"\" ,\"a\nnote\"\r\n\"1\",\" 2\",\"\"\r\n3,4,\"\"\"\"\r\n",
      "demo.csv", {"t"});
  EXPECT_EQ(data, (Eigen::MatrixXd(1, 2) << 1, 3).finished());
  const auto error = [](const std::string& row) {
    return refusal_of_csv("t,\"no\nte\"\n" + row, {"t"});
  };
  EXPECT_EQ(error("\"1,2\n3,4\n"), "demo.csv:3: a field in quotes does not end");
  EXPECT_THAT(error("\"1\"2,3\n"), HasSubstr("demo.csv:3: after a field in quotes must stand"));
  EXPECT_THAT(error("1,2\nx,2\n"), HasSubstr("demo.csv:4: column \"t\" is \"x\""));
  EXPECT_EQ(
      parse_demonstration("t,\"x, \"\"cm\"\"\"\n1,\"-2e1\"\n", "demo.csv", {"x, \"cm\""})(0, 0),
      -20);
}

TEST(CsvDemonstrationTest, TakesLineEndsOfEverySystem) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    const std::string text = "t,x" + end + "1,2" + end + "3,4" + end + end;
    EXPECT_EQ(parse_demonstration(text, "demo.csv", {"x"}),
              (Eigen::MatrixXd(1, 2) << 2, 4).finished());
    EXPECT_THAT(refusal_of_csv(text + "5,x", {"x"}), HasSubstr("demo.csv:4: is blank"));
  }
}

TEST(CsvDemonstrationTest, TakesPlusSignsAndNumbersBelowTheSmallest) {
  const Eigen::MatrixXd data =
      parse_demonstration("t\n+1.5\n+.5\n1e-310\n-4.9e-324\n1e-400\n", "demo.csv", {"t"});
  EXPECT_EQ(data, (Eigen::MatrixXd(1, 5) << 1.5, .5, 1e-310, -4.9e-324, 0).finished());
}

TEST(CsvDemonstrationTest, SaysWhatSeparatesTheColumnsWhereItIsNoComma) {
  const auto names = [](const std::string& text) {
    const std::string error = refusal_of_csv(text, {"x", "t"});
    EXPECT_THAT(error, HasSubstr("demo.csv:1: its columns have "));
    EXPECT_THAT(error, HasSubstr("must have commas"));
    return error.substr(29, error.find(" between") - 29);
  };
  EXPECT_EQ(names("t;x;y\n0;0;1\n"), "semicolons");
  EXPECT_EQ(names("\"t\";\"x\"\r\n0,5;0,1\r\n"), "semicolons");
  EXPECT_EQ(names("t\tx\n0\t0\n"), "tabs");
  EXPECT_EQ(names("t x\n0 0\n"), "blanks");
  EXPECT_THAT(refusal_of_csv("a;b\n1;2\n", {"t"}), HasSubstr("has no column \"t\""));
  EXPECT_EQ(parse_demonstration("t;x\n1\n", "demo.csv", {"t;x"})(0, 0), 1);
  // As a spreadsheet's "Unicode text": UTF-16 with tabs.
  EXPECT_EQ(refusal_of_csv(std::string("\xff\xfet\0\t\0x\0", 8), {"t"}),
            "demo.csv: is UTF-16: must be saved as UTF-8");
}

TEST(CsvDemonstrationTest, SetsFilesBesideEachOther) {
  const FileReader read = files({{"first", "t,x\n0,1\n1,2\n"}, {"second", "x,t\n5,2\n"}});
  const CsvDemonstration both = read_demonstration_files({"first", "second"}, {"t", "x"}, read);
  EXPECT_EQ(both.data, (Eigen::MatrixXd(2, 3) << 0, 1, 2, 1, 2, 5).finished());
  const CsvDemonstration other = read_demonstration_files({"second", "first"}, {"t", "x"}, read);
  EXPECT_NE(other.content, both.content);
  EXPECT_EQ(both.content.size(), 32U);
}

TEST(CsvDemonstrationTest, RefusesWhatIsNoFileAndWhatHoldsTooLittleOrTooMuch) {
  std::string many = "t\n";
  for (int i = 0; i <= 100000; ++i) many += "1\n";
  const auto error = [&](const std::string& file, const FileReader& read) -> std::string {
    try {
      read_demonstration_files({file}, {"t"}, read);
    } catch (const DemonstrationError& error) {
      return error.what();
    }
    return "";
  };
  const FileReader read = files({{"one", "t\n1\n"}, {"many", many}});
  EXPECT_EQ(error("none", read), "none: is no file");
  EXPECT_EQ(error("one", {}), "one: cannot be read: there are no files here");
  EXPECT_EQ(error("one", read), "one: holds less than 2 observations");
  EXPECT_THAT(error("many", read), HasSubstr("at most 100000 observations"));
}

}  // namespace
}  // namespace treeroll
