#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "server/base/number_check.h"
#include "server/operators/ctl/change_commands.h"
#include "server/operators/ctl/command_line.h"
#include "server/operators/ctl/halt_commands.h"

namespace pheromone::ctl {
namespace {

constexpr double kMaxUnits = 1e9;  // an upper bound for all; the server checks the pheromone's own

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
  bool all = false;
  RobotGoal goal;
};

// The options that erase and paint share.
void AddShape(CLI::App* command, ChangeArguments* it) {
  const CLI::Validator coordinate = Number(-kFarthestM, kFarthestM);
  command->add_option("PHEROMONE", it->pheromone, "Type number or name of the pheromone")
      ->required();
  auto* line =
      command->add_option("POINTS", it->shape.points_m, "The points X Y of a line, in metres")
          ->check(coordinate)
          ->type_name("X Y");
  command
      ->add_option("--radius", it->shape.radius_m,
                   "Distance from the line, in metres (default: 0.05)")
      ->check(Number(0, 1000))
      ->type_name("METRES")
      ->needs(line);
  auto* area = command
                   ->add_option("--area", it->shape.area_m,
                                "The rectangle between two opposite corners, in metres")
                   ->expected(4)
                   ->check(coordinate)
                   ->type_name("X Y X Y")
                   ->excludes(line);
  command->add_flag("--all", it->shape.all, "The whole map")->excludes(line)->excludes(area);
}

// Whether the arguments describe a shape; otherwise prints an error.
bool IsShape(const Shape& shape) {
  if (shape.all || !shape.area_m.empty() ||
      (!shape.points_m.empty() && shape.points_m.size() % 2 == 0)) {
    return true;
  }
  Fail(kUsage, shape.points_m.empty() ? "expected points X Y, --area or --all"
                                      : "odd number of coordinates, expected X Y of each point");
  return false;
}

void AddGoTo(CLI::App* program, const ServerOptions* options,
             const std::shared_ptr<ChangeArguments>& it, int* exit_status) {
  const CLI::Validator coordinate = Number(-kFarthestM, kFarthestM);
  CLI::App* go = program->add_subcommand(
      "goto", "Send a robot to a point, around the obstacles; it is halted there");
  go->add_option("LINK", it->goal.link, "Name of the robot's link")->required();
  go->add_option("ID", it->goal.id, "Robot ID on that link")
      ->required()
      ->check(WholeNumber(1, 254));
  go->add_option("X", it->goal.x_m, "X in metres")->check(coordinate);
  go->add_option("Y", it->goal.y_m, "Y in metres")->check(coordinate);
  go->add_option("--tolerance", it->goal.tolerance_m,
                 "Distance at which it has arrived, in metres (default: 0.1)")
      ->check(Number(0.01, 1000))
      ->type_name("METRES");
  go->add_flag("--cancel", it->goal.cancel, "Cancel its goal: it follows the map again");
  go->callback([=] {
    const RobotGoal& goal = it->goal;
    const bool whole = goal.cancel ? !goal.x_m && !goal.tolerance_m : goal.x_m && goal.y_m;
    *exit_status = whole ? GoTo(*options, goal) : Fail(kUsage, "expected either X Y or --cancel");
  });
}

}  // namespace

void AddChangeCommands(CLI::App* program, const ServerOptions* options, int* exit_status) {
  const auto it = std::make_shared<ChangeArguments>();
  const CLI::Validator coordinate = Number(-kFarthestM, kFarthestM);
  CLI::App* deposit = program->add_subcommand("deposit", "Deposit quanta of a pheromone at a node");
  deposit->add_option("PHEROMONE", it->pheromone, "Type number or name of the pheromone")
      ->required();
  deposit->add_option("X", it->x_m, "X in metres")->required()->check(coordinate);
  deposit->add_option("Y", it->y_m, "Y in metres")->required()->check(coordinate);
  deposit->add_option("--quanta", it->quanta, "Number of quanta (default: 1)")
      ->check(WholeNumber(1, 65'535))
      ->type_name("N");
  deposit->callback(
      [=] { *exit_status = Deposit(*options, it->pheromone, it->x_m, it->y_m, it->quanta); });

  CLI::App* erase =
      program->add_subcommand("erase", "Erase a pheromone along a line or in an area");
  AddShape(erase, it.get());
  erase->callback([=] {
    *exit_status = IsShape(it->shape) ? Erase(*options, it->pheromone, it->shape) : kUsage;
  });

  CLI::App* paint =
      program->add_subcommand("paint", "Paint a pheromone along a line or in an area");
  AddShape(paint, it.get());
  paint->add_option("--units", it->units, "Value for each node, in units (default: the maximum)")
      ->check(Number(0, kMaxUnits))
      ->type_name("U");
  paint->add_flag("--add", it->add, "Add to the present values instead of replacing them");
  paint->callback([=] {
    *exit_status =
        IsShape(it->shape) ? Paint(*options, it->pheromone, it->shape, it->units, it->add) : kUsage;
  });

  program->add_subcommand("undo", "Undo the last edit of the map")->callback([=] {
    *exit_status = Reverse(*options, false);
  });
  program->add_subcommand("redo", "Redo the edit that was undone last")->callback([=] {
    *exit_status = Reverse(*options, true);
  });

  CLI::App* command = program->add_subcommand("command", "Send a command to a robot");
  command->add_option("LINK", it->command.link, "Name of the robot's link")->required();
  command->add_option("ID", it->command.id, "Robot ID on that link")
      ->required()
      ->check(WholeNumber(1, 254));
  command
      ->add_option(
          "COMMAND", it->command.name,
          "halt, resume, speed MM_PER_S, follow TYPE, pick, drop, set PARAMETER VALUE, get "
          "PARAMETER, or go-to X Y for robots that find their way themselves; the others "
          "are led by goto")
      ->required();
  command->add_option("ARGUMENTS", it->command.words, "Whole numbers, as required by the command");
  command->add_flag("--no-wait", it->no_wait, "Do not wait for the robot's acknowledgement");
  command->callback([=] {
    it->command.wait = !it->no_wait;
    *exit_status = GiveCommand(*options, it->command);
  });

  AddGoTo(program, options, it, exit_status);
  program->add_subcommand("halt", "Halt all robots on all links")->callback([=] {
    *exit_status = HaltAll(*options);
  });
  CLI::App* resume = program->add_subcommand("resume", "Tell robots to drive on");
  resume->add_flag("--all", it->all, "All robots that are heard; one: command LINK ID resume")
      ->required();
  resume->callback([=] { *exit_status = ResumeAll(*options); });
  program->add_subcommand("reload", "Make the server reread its configuration")->callback([=] {
    *exit_status = ReloadConfig(*options);
  });
  program->add_subcommand("ticket", "Make a ticket with which a viewer may make changes")
      ->callback([=] { *exit_status = MakeTicket(*options); });
  program->add_subcommand("snapshot", "Write a durable snapshot of the server's state")
      ->callback([=] { *exit_status = MakeSnapshot(*options); });
}

}  // namespace pheromone::ctl
