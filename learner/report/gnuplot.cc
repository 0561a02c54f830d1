#include "learner/report/gnuplot.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "common/files/atomic_file.h"
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
  std::ifstream file(folder / (plot.id + ".svg"), std::ios::binary);
  std::string svg{std::istreambuf_iterator<char>(file), {}};
  if (said->exit_status != 0 || !svg.ends_with("</svg>\n\n")) {
    throw std::runtime_error(fmt::format("gnuplot {}.gp ended with status {} in {}", plot.id,
                                         said->exit_status, folder.string()));
  }
  return {.id = plot.id,
          .title = plot.title,
          .caption = plot.caption,
          .svg = std::move(svg),
          .file = place + "/" + plot.id + ".svg"};
}

}  // namespace treeroll::report
