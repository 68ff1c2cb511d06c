// pheromonectl deposit, erase, paint, command, halt, reload, snapshot: what an operator changes in
// a running server. Each says what was done, or on standard error why it was not, and returns the
// exit status (server_call.h). Lengths are in metres, from the map's origin of coordinates.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/ctl/server_call.h"

namespace pheromone::ctl {

/// Which nodes: one of the three.
struct Shape {
  bool all = false;
  std::vector<double> area_m;    ///< x, y of two opposite corners
  std::vector<double> points_m;  ///< x, y, x, y, ... of a line; with its radius
  std::optional<double> radius_m;
};

int Deposit(const ServerOptions& options, const std::string& pheromone, double x_m, double y_m,
            int quanta);
int Erase(const ServerOptions& options, const std::string& pheromone, const Shape& shape);
/// `units`: nothing is the pheromone's maximum.
int Paint(const ServerOptions& options, const std::string& pheromone, const Shape& shape,
          std::optional<double> units, bool add);

struct RobotCommand {
  std::string link;
  int id = 0;
  std::string name;
  std::vector<int64_t> arguments;
  bool wait = true;  ///< until the robot has acknowledged it, or will not any more
};
int GiveCommand(const ServerOptions& options, const RobotCommand& command);

int HaltAll(const ServerOptions& options);
int ReloadConfig(const ServerOptions& options);
int MakeSnapshot(const ServerOptions& options);

}  // namespace pheromone::ctl
