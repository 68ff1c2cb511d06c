#include "client_fw/core/tasks/forager.h"

namespace pheromone {
namespace client {

void PrepareForForaging(const NetTables& net, Parameters* parameters) {
  parameters->fail_safe_ms = 1000;
  for (uint8_t i = 0; i < net.place_count; ++i) {
    if ((net.marking >> i & 1u) != 0 && net.places[i].type != 0) {
      parameters->type = net.places[i].type;
    }
  }
}

void Forager::Step(Moment now_ms, const Odometry* odometry, Conversation* conversation) {
  NetStep step = NetStep();
  step.now_ms = now_ms;
  step.pace_ms = conversation->state().parameters.period_ms;
  step.pose_unit_10um = conversation->pose_unit_10um();
  step.is_held = odometry == nullptr || !conversation->requests().greeted ||
                 (conversation->state().flags & (kHalted | kPoseLost)) != 0;
  if (net_robot_.Step(step)) {
    conversation->Ask(net_robot_.exchange());
  }
  uint16_t tag = 0;
  if (net_robot_.TakeException(&tag)) {
    conversation->behaviour()->RaiseNetException(tag);
  }
  if (conversation->requests().greeted && net_robot_.line() != 0) {
    conversation->behaviour()->Follow(net_robot_.line());
  }
}

}  // namespace client
}  // namespace pheromone
