// pheromonectl: the operator's command line. For now, what needs no server.
//
// Exit status: 0; 1 if a file could not be read, understood or written; 2 for a mistake in the
// command line or the configuration.
#include <exception>
#include <iostream>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "server/ctl/map_commands.h"

namespace pheromone::ctl {
namespace {

// The options that draw and export share.
void AddSource(CLI::App* command, MapSource* source) {
  command
      ->add_option("--config", source->config,
                   "The configuration file; without one, the default configuration")
      ->type_name("FILE");
  command->add_option("--field", source->field, "What a server has saved, laid on the map")
      ->type_name("FILE");
  command
      ->add_option("--type", source->type,
                   "A pheromone; without this, the first one that lies on the map")
      ->type_name("N|NAME");
  command->add_option("--area", source->area_m, "Between two corners, in metres")
      ->expected(4)
      ->type_name("X Y X Y");
  command
      ->add_option("--nodes-per-cell", source->nodes_per_cell,
                   "So many nodes along a side make one cell, which shows the strongest")
      ->check(CLI::Range(1, 30'000))
      ->type_name("R");
}

int Main(int argc, char** argv) {
  CLI::App app("The operator's tool of the pheromone server.", "pheromonectl");
  app.set_version_flag("--version", "pheromonectl " PHEROMONE_VERSION);
  app.require_subcommand(1);
  CLI::App* map = app.add_subcommand("map", "Maps: draw, export, convert, info");
  map->require_subcommand(1);

  int status = 0;
  MapSource source;
  std::string in;
  std::string out;
  int pixels = 0;
  std::optional<double> white;
  std::optional<double> cell_m;

  CLI::App* draw = map->add_subcommand("draw", "Draw a pheromone in colours, obstacles gray");
  AddSource(draw, &source);
  draw->add_option("--pixels-per-cell", pixels, "The side of a cell in the picture")
      ->check(CLI::Range(1, 1000))
      ->type_name("K");
  draw->add_option("OUT", out, "A .png file")->required();
  draw->callback([&] { status = DrawMap(source, pixels, out); });

  CLI::App* save = map->add_subcommand(
      "export", "Write a pheromone in units (.npy, .csv), or the obstacles as a ROS map (.yaml)");
  AddSource(save, &source);
  save->add_option("OUT", out, "A .npy, .csv or .yaml file")->required();
  save->callback([&] { status = ExportMap(source, out); });

  CLI::App* convert = map->add_subcommand("convert", "Convert between .pgm .png .npy .csv .yaml");
  convert->add_option("--white", white, "The value that is white in a picture")
      ->check(CLI::PositiveNumber)
      ->type_name("VALUE");
  convert->add_option("--cell", cell_m, "The side of a cell in metres, for a ROS map")
      ->check(CLI::Range(1e-6, 1e6))
      ->type_name("METRES");
  convert->add_option("IN", in)->required();
  convert->add_option("OUT", out)->required();
  convert->callback([&] { status = ConvertRaster(in, out, white, cell_m); });

  CLI::App* info = map->add_subcommand("info", "Say what a raster or a saved field holds");
  info->add_option("FILE", in)->required();
  info->callback([&] { status = DescribeFile(in); });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsage;
  }
  return status;
}

}  // namespace
}  // namespace pheromone::ctl

int main(int argc, char** argv) {
  try {
    return pheromone::ctl::Main(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "pheromonectl: " << error.what() << '\n';
    return 1;
  }
}
