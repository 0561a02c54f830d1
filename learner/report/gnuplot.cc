#include "learner/report/gnuplot.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "common/files/atomic_file.h"
#include "common/files/whole_file.h"
#include "learner/worker_program/process.h"

namespace treeroll::report {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kDrawingTime{120};

fs::path find_gnuplot() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path program = fs::path(folder) / "gnuplot";
    if (access(program.c_str(), X_OK) == 0) return program;
  }
  throw std::runtime_error("gnuplot is not installed: apt-get install gnuplot-nox");
}

/// PNG holds its dots an inch in a chunk that gnuplot does not write: 11811 dots a metre are 300 an
/// inch. The last four bytes are the CRC of those before.
void tell_resolution(const fs::path& png) {
  constexpr std::size_t kHeaderEnd = 33;  // signature and IHDR
  constexpr std::string_view kChunk("\0\0\0\x09pHYs\0\0\x2e\x23\0\0\x2e\x23\x01\x78\xa5\x3f\x76",
                                    21);
  std::string bytes = read_whole_file(png);
  if (bytes.size() < kHeaderEnd) throw std::runtime_error(png.string() + ": is no PNG");
  write_atomically(png, bytes.insert(kHeaderEnd, kChunk));
}

/// The library that writes PDF dates it. A blank of the same length keeps all offsets in the file.
void take_date_away(const fs::path& pdf) {
  std::string bytes = read_whole_file(pdf);
  const std::size_t begin = bytes.find("/CreationDate (");
  const std::size_t end = bytes.find(')', begin);
  if (begin == std::string::npos || end == std::string::npos) return;
  write_atomically(pdf, bytes.replace(begin, end + 1 - begin, end + 1 - begin, ' '));
}

}  // namespace

Picture draw(const Plot& plot, const fs::path& folder, const std::string& place) {
  const fs::path gnuplot = find_gnuplot();
  write_atomically(folder / (plot.id + ".dat"), plot.data);
  write_atomically(folder / (plot.id + ".gp"), script_of(plot));
  // The script names its neighbours: it is to be run from its folder, by us as by a user.
  const Result<ProgramOutput> said =
      run_program("/usr/bin/env", {"--chdir=" + folder.string(), gnuplot.string(), plot.id + ".gp"},
                  "", kDrawingTime);
  if (!said) throw std::runtime_error("gnuplot: " + said.error().message);
  std::string svg;
  if (said->exit_status == 0) svg = read_whole_file(folder / (plot.id + ".svg"));
  if (!svg.ends_with("</svg>\n\n")) {
    throw std::runtime_error(fmt::format("gnuplot {}.gp ended with status {} in {}", plot.id,
                                         said->exit_status, folder.string()));
  }
  tell_resolution(folder / (plot.id + ".png"));
  take_date_away(folder / (plot.id + ".pdf"));
  return {.id = plot.id,
          .title = plot.title,
          .caption = plot.caption,
          .svg = std::move(svg),
          .file = place + "/" + plot.id + ".svg"};
}

}  // namespace treeroll::report
