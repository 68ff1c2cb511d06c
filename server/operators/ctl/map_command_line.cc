#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "server/base/number_check.h"
#include "server/operators/ctl/command_line.h"
#include "server/operators/ctl/map_commands.h"

namespace pheromone::ctl {
namespace {

struct MapArguments {
  MapSource source;
  std::string in;
  std::string out;
  int pixels = 0;
  std::optional<double> white;
  std::optional<double> cell_m;
  std::vector<std::string> types;
};

// The options that draw and export share.
void AddSource(CLI::App* command, MapSource* source) {
  command
      ->add_option("--config", source->config,
                   "The configuration file (default: the built-in configuration)")
      ->type_name("FILE");
  command->add_option("--field", source->field, "Load a field that a server has saved")
      ->type_name("FILE");
  command->add_option("--type", source->type, "The pheromone (default: the first one on the map)")
      ->type_name("N|NAME");
  command
      ->add_option("--area", source->area_m,
                   "The rectangle between two opposite corners, in metres")
      ->expected(4)
      ->check(Number(-kFarthestM, kFarthestM))
      ->type_name("X Y X Y");
  command
      ->add_option("--nodes-per-cell", source->nodes_per_cell,
                   "Combine R by R nodes into a cell that shows their maximum")
      ->check(WholeNumber(1, 30'000))
      ->type_name("R");
}

}  // namespace

void AddMapCommands(CLI::App* program, int* exit_status) {
  const auto arguments = std::make_shared<MapArguments>();
  MapArguments* it = arguments.get();
  CLI::App* map =
      program->add_subcommand("map", "Maps in files: draw, export, convert, resample, info");
  map->require_subcommand(1);

  CLI::App* draw =
      map->add_subcommand("draw", "Draw a pheromone as a PNG image, or with axes as PDF or SVG");
  AddSource(draw, &it->source);
  draw->add_option("--pixels-per-cell", it->pixels, "Side of a cell in pixels")
      ->check(WholeNumber(1, 1000))
      ->type_name("K");
  draw->add_option("OUT", it->out, "A .png file; or .pdf, .svg: with axes, colour scale and legend")
      ->required();
  draw->callback([arguments, exit_status] {
    *exit_status = DrawMap(arguments->source, arguments->pixels, arguments->out);
  });

  CLI::App* save = map->add_subcommand(
      "export", "Write a pheromone in units (.npy, .csv), or the obstacles as a ROS map (.yaml)");
  AddSource(save, &it->source);
  save->add_option("OUT", it->out, "A .npy, .csv or .yaml file")->required();
  save->callback(
      [arguments, exit_status] { *exit_status = ExportMap(arguments->source, arguments->out); });

  CLI::App* convert = map->add_subcommand("convert", "Convert between .pgm .png .npy .csv .yaml");
  convert->add_option("--white", it->white, "Value of white in an image")
      ->check(Number(1e-12, 1e12))
      ->type_name("VALUE");
  convert->add_option("--cell", it->cell_m, "Side of a cell in metres, for a ROS map")
      ->check(Number(1e-6, 1e6))
      ->type_name("METRES");
  convert->add_option("IN", it->in)->required();
  convert->add_option("OUT", it->out)->required();
  convert->callback([arguments, exit_status] {
    *exit_status =
        ConvertRaster(arguments->in, arguments->out, arguments->white, arguments->cell_m);
  });

  CLI::App* resample = map->add_subcommand(
      "resample", "Move a saved field to the map of another configuration, node by node");
  resample->add_option("--config", it->source.config, "The configuration with the new map")
      ->required()
      ->type_name("FILE");
  resample->add_option("--type", it->types, "A pheromone to move; repeatable (default: all)")
      ->type_name("N|NAME");
  resample->add_option("IN", it->in, "A field that a server has saved")->required();
  resample->add_option("OUT", it->out, "Output file, for pheromoned --load-field")->required();
  resample->callback([arguments, exit_status] {
    *exit_status =
        ResampleField(arguments->source.config, arguments->types, arguments->in, arguments->out);
  });

  CLI::App* info =
      map->add_subcommand("info", "Print the size and contents of a raster or a saved field");
  info->add_option("FILE", it->in)->required();
  info->callback([arguments, exit_status] { *exit_status = DescribeFile(arguments->in); });
}

}  // namespace pheromone::ctl
