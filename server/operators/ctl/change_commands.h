// pheromonectl deposit, erase, paint, undo, redo, command, goto, reload, snapshot: an operator's
// changes of a running server. Each prints what was done, or an error on standard error, and
// returns the exit status (server_call.h). Lengths are in metres, from the map's origin of
// coordinates.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

/// The nodes: exactly one of the three.
struct Shape {
  bool all = false;
  std::vector<double> area_m;    ///< x, y of two opposite corners
  std::vector<double> points_m;  ///< x, y, x, y, ... of a line; with its radius
  std::optional<double> radius_m;
};

int Deposit(const ServerOptions& options, const std::string& pheromone, double x_m, double y_m,
            int quanta);
int Erase(const ServerOptions& options, const std::string& pheromone, const Shape& shape);
/// `units`: empty is the pheromone's maximum.
int Paint(const ServerOptions& options, const std::string& pheromone, const Shape& shape,
          std::optional<double> units, bool add);

/// Undoes the last edit, or redoes the one that was undone last.
int Reverse(const ServerOptions& options, bool redo);

struct RobotCommand {
  std::string link;
  int id = 0;
  std::string name;
  std::vector<std::string> words = {};  ///< its arguments, as they were typed
  std::vector<int64_t> arguments = {};  ///< the same, once they were read
  bool wait = true;  ///< until the robot has acknowledged it or the server has given up
};
int GiveCommand(const ServerOptions& options, RobotCommand command);

struct RobotGoal {
  std::string link;
  int id = 0;
  std::optional<double> x_m;  ///< with y_m, or to cancel
  std::optional<double> y_m;
  std::optional<double> tolerance_m;
  bool cancel = false;
};
int GoTo(const ServerOptions& options, const RobotGoal& goal);

int ReloadConfig(const ServerOptions& options);
int MakeTicket(const ServerOptions& options);
int MakeSnapshot(const ServerOptions& options);

}  // namespace pheromone::ctl
