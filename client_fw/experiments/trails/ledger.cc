#include "client_fw/experiments/trails/ledger.h"

#include <algorithm>
#include <cassert>

namespace pheromone::swarm {

using protocol::NetAction;

void TrailsLedger::Add(const NetTold& told) {
  assert(told.id > 0 && told.id <= robots_.size());
  ++records_;
  if (!told.accepted) {
    ++refusals_;
    return;
  }
  const int number = told.id - 1;
  Robot& robot = robots_[static_cast<size_t>(number)];
  const NetAction action = told.record.action;
  if (action == NetAction::kChooseA || action == NetAction::kChooseB) {
    robot.on_trail = true;
    robot.trail = action == NetAction::kChooseA ? BenchTrail::kA : BenchTrail::kB;
    robot.chosen_ms = told.time_ms;
    choices_.push_back({told.time_ms, number, robot.trail});
  } else if (action == NetAction::kTake) {
    taken_ += told.granted;
  } else if (action == NetAction::kStoreA || action == NetAction::kStoreB) {
    robot.on_trail = false;
    robot.deposit = static_cast<int64_t>(deposits_.size());
    deposited_ += told.record.amount;
    deposits_.push_back({.robot = number,
                         .trail = action == NetAction::kStoreA ? BenchTrail::kA : BenchTrail::kB,
                         .chosen_ms = robot.chosen_ms,
                         .stored_ms = told.time_ms,
                         .home_ms = -1,
                         .amount = told.record.amount});
  } else if (action == NetAction::kLeave && robot.deposit >= 0) {
    deposits_[static_cast<size_t>(robot.deposit)].home_ms = told.time_ms;
    robot.deposit = -1;
    ++trips_;
  }
}

int TrailsLedger::robots_on(BenchTrail trail) const {
  return static_cast<int>(std::count_if(
      robots_.begin(), robots_.end(),
      [trail](const Robot& robot) { return robot.on_trail && robot.trail == trail; }));
}

}  // namespace pheromone::swarm
