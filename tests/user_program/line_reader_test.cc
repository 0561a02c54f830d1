#include "workers/user_program/line_reader.h"

#include <gmock/gmock.h>

#include <vector>

namespace treeroll::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::string> lines_of(LineReader& reader) {
  std::vector<std::string> lines;
  while (auto line = reader.next()) lines.push_back(*std::move(line));
  return lines;
}

TEST(LineReaderTest, GivesTheSameLinesWhereverTheBytesAreCut) {
  const std::string text = "one\ntwo\r\n\nthree\n";
  for (std::size_t cut = 0; cut <= text.size(); ++cut) {
    LineReader reader;
    reader.add(text.substr(0, cut));
    reader.add(text.substr(cut));
    EXPECT_THAT(lines_of(reader), ElementsAre("one", "two", "", "three")) << cut;
    EXPECT_EQ(reader.num_bytes_unfinished(), 0);
  }
}

TEST(LineReaderTest, WhatHasNoLineBreakIsALineOnceTheOtherSideHasEnded) {
  LineReader reader;
  reader.add("last words");
  EXPECT_THAT(lines_of(reader), IsEmpty());
  EXPECT_EQ(reader.num_bytes_unfinished(), 10);
  reader.finish();
  reader.finish();
  EXPECT_THAT(lines_of(reader), ElementsAre("last words"));
}

}  // namespace
}  // namespace treeroll::worker
