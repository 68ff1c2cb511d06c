#include "client_fw/swarm/scenario_report.h"

#include <fmt/format.h>

#include <array>
#include <numbers>

#include "client_fw/swarm/picture.h"

namespace pheromone::swarm {
namespace {

// Colours that stay apart for most eyes (Paul Tol's "bright" and "muted").
constexpr std::array<const char*, 8> kColours = {"#4477aa", "#ee6677", "#228833", "#aa3377",
                                                 "#66ccee", "#332288", "#999933", "#882255"};
constexpr std::array<std::array<const char*, 2>, 3> kShades = {
    {{"#e08214", "#b35806"}, {"#8073ac", "#542788"}, {"#5aae61", "#1b7837"}}};

}  // namespace

std::string Summarise(const Scenario& scenario, const ScenarioResult& result) {
  const bool has_path = !scenario.engine.field.paths.empty();
  std::string text =
      fmt::format("{}: {} robots, {:.1f} s, seed {}\n", scenario.name, result.robots.size(),
                  static_cast<double>(scenario.duration_ms) / 1000, scenario.seed);
  for (size_t i = 0; i < result.robots.size(); ++i) {
    const RobotResult& robot = result.robots[i];
    const client::Counters& c = robot.counters;
    text += fmt::format("robot {}: ", i + 1);
    if (has_path) {
      text += fmt::format("{:.2f} m along the path, {:.0f} mm from it in the mean; ",
                          robot.progress_m, robot.mean_error_m * 1000);
    }
    text += fmt::format("{} requests, {} answers, {} timeouts, {} errors, {} fail-safe stops",
                        c.requests, c.answers, c.timeouts, c.errors, c.fail_safe_stops);
    if (robot.off_limits_samples > 0) {
      text += fmt::format("; in an obstacle or off the map in {} of {} samples",
                          robot.off_limits_samples, robot.track.size());
    }
    text += '\n';
  }
  for (size_t i = 0; i < result.channels.size(); ++i) {
    const ChannelResult& channel = result.channels[i];
    text += fmt::format("channel {}: in use {:.1f} %, {} frames, {} collided, {} late answers\n",
                        i + 1, channel.utilisation * 100, channel.radio.blocks,
                        channel.radio.collided_blocks, channel.late_answers);
  }
  return text + fmt::format("state hash {:016x}\n", result.state_hash);
}

std::string TracksToCsv(const ScenarioResult& result) {
  std::string csv =
      "robot,time_s,x_m,y_m,heading_deg,p_left,p_right,wheel_left_mm_s,wheel_right_mm_s\n";
  for (size_t i = 0; i < result.robots.size(); ++i) {
    for (const Sample& s : result.robots[i].track) {
      csv += fmt::format("{},{:.3f},{:.4f},{:.4f},{:.2f},{:.4f},{:.4f},{},{}\n", i + 1,
                         static_cast<double>(s.time_ms) / 1000, s.pose.x_m, s.pose.y_m,
                         s.pose.heading_rad * 180 / std::numbers::pi, s.p_left / 4096.0,
                         s.p_right / 4096.0, s.wheels.left_mm_s, s.wheels.right_mm_s);
    }
  }
  return csv;
}

std::string ExchangesToCsv(const ScenarioResult& result) {
  std::string csv = "time_s,robot,requests,p_left,p_right\n";
  for (const Exchange& e : result.exchanges) {
    csv += fmt::format("{:.3f},{},{},{:.4f},{:.4f}\n", static_cast<double>(e.time_ms) / 1000,
                       e.robot + 1, e.requests, e.p_left / 4096.0, e.p_right / 4096.0);
  }
  return csv;
}

std::string DrawScenario(const Scenario& scenario, const ScenarioResult& result) {
  const field::FieldConfig& config = scenario.engine.field;
  Picture picture;
  picture.title = fmt::format("{}: {} robots, {:.0f} s", scenario.name, result.robots.size(),
                              static_cast<double>(scenario.duration_ms) / 1000);
  if (!config.paths.empty()) {
    picture.path = config.paths.front();
  }
  for (size_t i = 0; i < config.pheromones.size(); ++i) {
    const auto& [colour, node_colour] = kShades[i % kShades.size()];
    picture.shades.push_back({config.pheromones[i].type, colour, node_colour, 0.1});
  }
  for (size_t i = 0; i < result.robots.size(); ++i) {
    picture.ways.push_back({fmt::format("robot {}", i + 1), kColours[i % kColours.size()],
                            result.robots[i].track, i < kColours.size()});
  }
  return Draw(picture, field::Field(config), 0);
}

}  // namespace pheromone::swarm
