// lab_levels: the levels of the lab beside each other, for 8, 16 and 20 robots and 0, 1 and 5 % of
// the frames lost. By hand; half a minute of CPU time with six seeds.
//
//   lab_levels client_fw/lab/examples/levels.toml --seeds 6 --csv client_fw/lab/results/levels.csv
//
// Exit status 1 if a cell does not hold (client_fw/swarm/lab_levels.h says when it does).
#include "client_fw/swarm/lab_levels.h"

#include <fmt/format.h>

#include <cstdio>
#include <string>

#include <CLI/CLI.hpp>

#include "server/base/file.h"
#include "server/base/number_check.h"

namespace pheromone::lab::bench {
namespace {

std::string RowOf(Level level, const swarm::LevelCell& cell, const swarm::LevelFigures& figures,
                  const swarm::LevelFigures& air, const swarm::Agreement& agreement) {
  const auto word = [](bool good) { return good ? "yes" : "no"; };
  const auto ratio = [](double of, double to) {
    return to == 0 ? std::string() : fmt::format("{:.3f}", of / to);
  };
  return fmt::format(
      "{},{},{},{},{:.2f},{:.2f},{:.0f},{},{},{},{},{},{}\n", cell.lost_percent, cell.robots,
      NameOf(level), cell.seeds, figures.answers_per_s, figures.path_error_mm, figures.stops,
      ratio(figures.answers_per_s, air.answers_per_s),
      ratio(figures.path_error_mm, air.path_error_mm), ratio(figures.stops, air.stops),
      word(agreement.answers), word(agreement.path_error), word(agreement.stops));
}

int Main(const std::string& file, int seeds, const std::string& csv) {
  std::string table =
      "lost_percent,robots,level,seeds,answers_per_s,path_error_mm,fail_safe_stops,"
      "answers_of_radio,path_error_of_radio,stops_of_radio,answers_hold,path_error_holds,"
      "stops_hold\n";
  fmt::print("{}", table);
  bool all_hold = true;
  for (const int lost : {0, 1, 5}) {
    for (const int robots : {8, 16, 20}) {
      const swarm::LevelCell cell{robots, lost, seeds};
      swarm::LevelFigures air;
      for (const Level level : {Level::kRadio, Level::kFirmware, Level::kField}) {
        const auto figures = swarm::MeasureLevel(file, level, cell);
        if (!figures.ok()) {
          fmt::print(stderr, "lab_levels: {}\n", figures.error());
          return 2;
        }
        if (level == Level::kRadio) {
          air = figures.value();
        }
        const swarm::Agreement agreement = swarm::Compare(figures.value(), air);
        all_hold &= agreement.holds();
        const std::string row = RowOf(level, cell, figures.value(), air, agreement);
        fmt::print("{}", row);
        std::fflush(stdout);
        table += row;
      }
    }
  }
  if (!csv.empty()) {
    if (const Status written = WriteFile(csv, table); !written.ok()) {
      fmt::print(stderr, "lab_levels: {}\n", written.error());
      return 2;
    }
  }
  return all_hold ? 0 : 1;
}

}  // namespace
}  // namespace pheromone::lab::bench

int main(int argc, char** argv) {
  CLI::App app("The levels of the lab beside each other.");
  std::string file;
  int seeds = 10;
  std::string csv;
  app.add_option("scenario", file, "A scenario with a path and 20 starts")->required();
  app.add_option("--seeds", seeds, "Runs of each cell and level")
      ->check(pheromone::WholeNumber(1, 1000));
  app.add_option("--csv", csv, "Write the rows to this file");
  CLI11_PARSE(app, argc, argv);
  return pheromone::lab::bench::Main(file, seeds, csv);
}
