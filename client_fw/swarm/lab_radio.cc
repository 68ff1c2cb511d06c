#include "client_fw/swarm/lab_radio.h"

#include <cmath>
#include <vector>

#include "client_fw/lab/link/rounds_link.h"
#include "client_fw/swarm/scenario/run.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kSampleMs = 1000;

}  // namespace

Scenario OnAir(const lab::LabScenario& scenario) {
  Scenario on_air;
  on_air.name = scenario.name;
  on_air.engine.field = scenario.world.field;
  on_air.engine.pose_unit_10um = scenario.world.pose_unit_10um;
  on_air.duration_ms = scenario.duration_ms;
  on_air.sample_ms = kSampleMs;
  on_air.seed = scenario.world.seed;
  const lab::RadioModel& radio = *scenario.world.radio;
  on_air.loss = radio.lost_percent / 100.0;
  for (size_t i = 0; i < scenario.world.groups.size(); ++i) {
    const lab::RobotGroup& from = scenario.world.groups[i];
    RobotGroup group;
    static_cast<client::Settings&>(group.client) = lab::FollowSettings(scenario.plans[i].values);
    group.client.start_released = true;
    group.client.type = from.senses.front();
    group.starts = from.starts;
    group.count = static_cast<int>(from.starts.size());
    group.radius_m = from.radius_m;
    on_air.groups.push_back(group);
  }
  on_air.channels = static_cast<int>(
      lab::ChannelsOf(static_cast<size_t>(on_air.robot_count()), radio.robots_per_channel));
  Complete(&on_air);
  return on_air;
}

lab::LabResult MeasuredOnAir(const lab::LabScenario& scenario, const SwarmRecord& record) {
  const int64_t from_ms = scenario.world.measure_from_ms;
  lab::LabResult result;
  result.on_air = true;
  result.robots = record.robots.size();
  result.step_ms = 1;
  result.steps = static_cast<uint64_t>(record.duration_ms);
  result.hash = record.state_hash.value_or(0);
  result.measured_ms = record.duration_ms - from_ms;
  lab::Heard& heard = result.tally.heard;
  std::vector<int64_t> heard_ms(record.robots.size(), -1);
  // A robot without an answer until `until_ms` has stopped when the fail-safe time was over.
  const auto count_stop = [&](size_t robot, int64_t until_ms) {
    const int64_t stop_ms = heard_ms[robot] + lab::kFailSafeMs;
    if (heard_ms[robot] >= 0 && stop_ms < until_ms && stop_ms >= from_ms) {
      ++heard.fail_safe_stops;
    }
  };
  for (const Exchange& exchange : record.exchanges) {
    heard.answers += exchange.time_ms >= from_ms ? 1u : 0u;
    count_stop(exchange.robot, exchange.time_ms);
    heard_ms[exchange.robot] = exchange.time_ms;
  }
  for (size_t i = 0; i < record.robots.size(); ++i) {
    count_stop(i, record.duration_ms);
    for (const Sample& sample : record.robots[i].track) {
      if (!scenario.world.field.paths.empty() && sample.time_ms > from_ms) {
        result.tally.path_errors +=
            {static_cast<uint64_t>(std::llround(sample.distance_m * 1e6)), 1};
      }
    }
  }
  return result;
}

lab::LabResult RunLabOnAir(const lab::LabScenario& scenario,
                           const std::function<void(int64_t ms)>& progress) {
  return MeasuredOnAir(scenario, RunScenario(OnAir(scenario), progress));
}

}  // namespace pheromone::swarm
