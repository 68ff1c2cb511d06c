#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "server/ctl/change_commands.h"
#include "server/ctl/command_line.h"
#include "server/ctl/number_check.h"

namespace pheromone::ctl {
namespace {

constexpr double kMostUnits = 1e9;  // which of them a pheromone may have, the server knows

struct ChangeArguments {
  std::string pheromone;
  double x_m = 0;
  double y_m = 0;
  int quanta = 1;
  Shape shape;
  std::optional<double> units;
  bool add = false;
  RobotCommand command;
  bool no_wait = false;
};

// The options that erase and paint share.
void AddShape(CLI::App* command, ChangeArguments* it) {
  const CLI::Validator coordinate = Number(-kFarthestM, kFarthestM);
  command->add_option("PHEROMONE", it->pheromone, "Its number or name")->required();
  auto* line =
      command->add_option("POINTS", it->shape.points_m, "X Y of each point of a line, in metres")
          ->check(coordinate)
          ->type_name("X Y");
  command->add_option("--radius", it->shape.radius_m, "How far from the line, in metres (0.05)")
      ->check(Number(0, 1000))
      ->type_name("METRES")
      ->needs(line);
  auto* area = command->add_option("--area", it->shape.area_m, "Between two corners, in metres")
                   ->expected(4)
                   ->check(coordinate)
                   ->type_name("X Y X Y")
                   ->excludes(line);
  command->add_flag("--all", it->shape.all, "The whole map")->excludes(line)->excludes(area);
}

// Whether the shape is one; otherwise it was told what is wrong.
bool IsShape(const Shape& shape) {
  if (shape.all || !shape.area_m.empty() ||
      (!shape.points_m.empty() && shape.points_m.size() % 2 == 0)) {
    return true;
  }
  Fail(kUsage, shape.points_m.empty() ? "expected points X Y, --area or --all"
                                      : "a point without its Y, expected X Y of each point");
  return false;
}

}  // namespace

void AddChangeCommands(CLI::App* program, const ServerOptions* options, int* exit_status) {
  const auto it = std::make_shared<ChangeArguments>();
  const CLI::Validator coordinate = Number(-kFarthestM, kFarthestM);
  CLI::App* deposit = program->add_subcommand("deposit", "Lay quanta of a pheromone at a node");
  deposit->add_option("PHEROMONE", it->pheromone, "Its number or name")->required();
  deposit->add_option("X", it->x_m, "In metres")->required()->check(coordinate);
  deposit->add_option("Y", it->y_m, "In metres")->required()->check(coordinate);
  deposit->add_option("--quanta", it->quanta, "How many (1)")
      ->check(WholeNumber(1, 65'535))
      ->type_name("N");
  deposit->callback(
      [=] { *exit_status = Deposit(*options, it->pheromone, it->x_m, it->y_m, it->quanta); });

  CLI::App* erase = program->add_subcommand("erase", "Take a pheromone away");
  AddShape(erase, it.get());
  erase->callback([=] {
    *exit_status = IsShape(it->shape) ? Erase(*options, it->pheromone, it->shape) : kUsage;
  });

  CLI::App* paint =
      program->add_subcommand("paint", "Paint a pheromone along a line or on an area");
  AddShape(paint, it.get());
  paint->add_option("--units", it->units, "What each node gets; without it, the maximum")
      ->check(Number(0, kMostUnits))
      ->type_name("U");
  paint->add_flag("--add", it->add, "Add it to what is there");
  paint->callback([=] {
    *exit_status =
        IsShape(it->shape) ? Paint(*options, it->pheromone, it->shape, it->units, it->add) : kUsage;
  });

  CLI::App* command = program->add_subcommand("command", "Give a robot a command");
  command->add_option("LINK", it->command.link, "The name of its link")->required();
  command->add_option("ID", it->command.id, "Its number on the link")
      ->required()
      ->check(WholeNumber(1, 254));
  command
      ->add_option("COMMAND", it->command.name,
                   "halt, resume, speed MM_PER_S, go-to X Y, follow TYPE, pick, drop, "
                   "set PARAMETER VALUE or get PARAMETER")
      ->required();
  command->add_option("ARGUMENTS", it->command.arguments, "Whole numbers, as the command has them")
      ->check(WholeNumber(INT32_MIN, INT32_MAX));
  command->add_flag("--no-wait", it->no_wait, "Do not wait for the robot's word");
  command->callback([=] {
    it->command.wait = !it->no_wait;
    *exit_status = GiveCommand(*options, it->command);
  });

  program->add_subcommand("halt", "Halt all robots of all links")->callback([=] {
    *exit_status = HaltAll(*options);
  });
  program->add_subcommand("reload", "Have the configuration read again")->callback([=] {
    *exit_status = ReloadConfig(*options);
  });
  program->add_subcommand("snapshot", "Have a durable snapshot made")->callback([=] {
    *exit_status = MakeSnapshot(*options);
  });
}

}  // namespace pheromone::ctl
