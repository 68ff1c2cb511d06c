// The constant tables of a robots' net, as `pheromonectl net tables` writes them into a header:
//
//   #include "client_fw/core/tasks/robot_net.h"   // kRobotNet, from
//   deploy/examples/nets/robot.toml Fire(kRobotNet.transitions[4].arcs, &marking)
//
// Places and transitions are numbered from 0 here, in the order of the file; transitions from 1 in
// records on tags. Constants; any thread, any interrupt.
#pragma once

#include <stdint.h>

#include "client_fw/core/tasks/net_executor.h"
#include "protocol/robot_net.h"

namespace pheromone {
namespace client {

struct NetPlaceRow {
  protocol::PlaceDoes does;
  uint8_t type;  ///< the line's pheromone type; kFollow and kWait
};

struct NetTransitionRow {
  NetTransition arcs;
  protocol::TransitionDoes does;
};

struct NetTables {
  uint32_t hash;     ///< protocol/README.md, "Records of nets"
  uint32_t marking;  ///< initially; always exactly one marked place does something
  const NetPlaceRow* places;
  const NetTransitionRow* transitions;
  uint8_t place_count;
  uint8_t transition_count;
};

}  // namespace client
}  // namespace pheromone
