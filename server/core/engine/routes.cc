#include "server/core/engine/routes.h"

#include <array>

namespace pheromone::engine {
namespace {

using Routes = std::array<Route, 256>;

Routes MakeRoutes() {
  Routes routes{};
  const auto add = [&routes](Route::Part part, int first, int last) {
    for (int i = first; i <= last; ++i) {
      const auto opcode = static_cast<uint8_t>(i);
      const Route::Effect effect = opcode == protocol::kHello        ? Route::Effect::kHello
                                   : opcode == protocol::kCommandAck ? Route::Effect::kAck
                                   : protocol::IsMutating(opcode)    ? Route::Effect::kChanges
                                                                     : Route::Effect::kReads;
      routes[opcode] = {part, protocol::LengthOf(opcode), effect};
    }
  };
  for (const int opcode :
       {protocol::kHello, protocol::kPing, protocol::kEvent, protocol::kCommandAck}) {
    add(Route::Part::kRobots, opcode, opcode);
  }
  for (const int service : {protocol::kSense, protocol::kSenseWide, protocol::kDeposit,
                            protocol::kTrace, protocol::kTraceWide}) {
    add(Route::Part::kField, service | protocol::kMinType, service | protocol::kMaxType);
  }
  add(Route::Part::kTags, protocol::kScan, protocol::kResolve);
  return routes;
}

}  // namespace

const Route& RouteOf(uint8_t opcode) {
  static const Routes routes = MakeRoutes();
  return routes[opcode];
}

}  // namespace pheromone::engine
