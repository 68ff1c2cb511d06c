#include "client_fw/swarm/scenario/report.h"

#include <fmt/format.h>

#include <algorithm>
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

const RobotGroup& GroupOf(const Scenario& scenario, size_t robot) {
  size_t end = 0;
  for (const RobotGroup& group : scenario.groups) {
    end += static_cast<size_t>(group.count);
    if (robot < end) {
      return group;
    }
  }
  return scenario.groups.back();
}

std::string SummaryOf(const RobotGroup& group, const RobotRecord& robot, bool has_path) {
  const client::Counters& c = robot.counters;
  std::string text;
  if (has_path) {
    text += fmt::format("{:.2f} m along the path, {:.0f} mm from it on average; ", robot.progress_m,
                        robot.mean_error_m * 1000);
  }
  text += group.image.empty()
              ? fmt::format("{} requests, {} answers, {} timeouts, {} errors, {} fail-safe stops",
                            c.requests, c.answers, c.timeouts, c.errors, c.fail_safe_stops)
              : fmt::format("{} requests, {} answers, {} errors as counted by its modem",
                            c.requests, c.answers, c.errors);
  if (c.ignored_carriers + c.ignored_noise + c.ignored_damage > 0) {
    text += fmt::format("; ignored {} carriers, {} runs of noise, {} damaged frames",
                        c.ignored_carriers, c.ignored_noise, c.ignored_damage);
  }
  if (robot.bumps > 0) {
    text += fmt::format("; {} bumps", robot.bumps);
  }
  if (robot.off_limits_samples > 0) {
    text += fmt::format("; in an obstacle or off the map in {} of {} samples",
                        robot.off_limits_samples, robot.track.size());
  }
  return text;
}

// The modem of an image gets its frames in pieces.
bool HasImages(const Scenario& scenario) {
  return std::any_of(scenario.groups.begin(), scenario.groups.end(),
                     [](const RobotGroup& group) { return !group.image.empty(); });
}

std::string SummaryOf(const ChannelRecord& channel, bool images) {
  std::string text = fmt::format("in use {:.1f} %, {} {}, {} collided", channel.utilisation * 100,
                                 channel.radio.blocks, images ? "parts of frames" : "frames",
                                 channel.radio.collided_blocks);
  if (channel.late_answers) {
    text += fmt::format(", {} late answers", *channel.late_answers);
  }
  if (channel.reconnects) {
    text += fmt::format(", {} reconnects", *channel.reconnects);
  }
  return text;
}

}  // namespace

std::string Summarise(const Scenario& scenario, const SwarmRecord& record) {
  const bool has_path = !scenario.engine.field.paths.empty();
  std::string text =
      fmt::format("{}: {} robots, {:.1f} s, seed {}\n", scenario.name, record.robots.size(),
                  static_cast<double>(record.duration_ms) / 1000, scenario.seed);
  for (size_t i = 0; i < record.robots.size(); ++i) {
    text += fmt::format("robot {}: {}\n", i + 1,
                        SummaryOf(GroupOf(scenario, i), record.robots[i], has_path));
  }
  for (size_t i = 0; i < record.channels.size(); ++i) {
    text +=
        fmt::format("channel {}: {}\n", i + 1, SummaryOf(record.channels[i], HasImages(scenario)));
  }
  if (record.state_hash) {
    text += fmt::format("state hash {:016x}\n", *record.state_hash);
  }
  return text;
}

std::string RobotsToCsv(const Scenario& scenario, const SwarmRecord& record) {
  std::string csv =
      "robot,client,drive,requests,answers,timeouts,errors,fail_safe_stops,bumps,progress_m,"
      "mean_error_mm\n";
  for (size_t i = 0; i < record.robots.size(); ++i) {
    const RobotGroup& group = GroupOf(scenario, i);
    const RobotRecord& robot = record.robots[i];
    const client::Counters& c = robot.counters;
    const bool core = group.image.empty();
    csv += fmt::format("{},{},{},{},{},{},{},{},{},{:.3f},{:.1f}\n", i + 1, core ? "core" : "avr",
                       group.pioneer == nullptr ? "ideal" : group.pioneer->subclass, c.requests,
                       c.answers, core ? std::to_string(c.timeouts) : "", c.errors,
                       core ? std::to_string(c.fail_safe_stops) : "", robot.bumps, robot.progress_m,
                       robot.mean_error_m * 1000);
  }
  return csv;
}

std::string TracksToCsv(const SwarmRecord& record) {
  std::string csv =
      "robot,time_s,x_m,y_m,heading_deg,p_left,p_right,wheel_left_mm_s,wheel_right_mm_s\n";
  for (size_t i = 0; i < record.robots.size(); ++i) {
    for (const Sample& s : record.robots[i].track) {
      csv += fmt::format("{},{:.3f},{:.4f},{:.4f},{:.2f},{:.4f},{:.4f},{},{}\n", i + 1,
                         static_cast<double>(s.time_ms) / 1000, s.pose.x_m, s.pose.y_m,
                         s.pose.heading_rad * 180 / std::numbers::pi, s.p_left / 4096.0,
                         s.p_right / 4096.0, s.wheels.left_mm_s, s.wheels.right_mm_s);
    }
  }
  return csv;
}

std::string ExchangesToCsv(const SwarmRecord& record) {
  std::string csv = "time_s,robot,requests,p_left,p_right\n";
  for (const Exchange& e : record.exchanges) {
    csv += fmt::format("{:.3f},{},{},{:.4f},{:.4f}\n", static_cast<double>(e.time_ms) / 1000,
                       e.robot + 1, e.requests, e.p_left / 4096.0, e.p_right / 4096.0);
  }
  return csv;
}

std::string DrawScenario(const Scenario& scenario, const SwarmRecord& record) {
  const field::FieldConfig& config = scenario.engine.field;
  Picture picture;
  picture.title = fmt::format("{}: {} robots, {:.0f} s", scenario.name, record.robots.size(),
                              static_cast<double>(scenario.duration_ms) / 1000);
  if (!config.paths.empty()) {
    picture.path = config.paths.front();
  }
  for (size_t i = 0; i < config.pheromones.size(); ++i) {
    const auto& [colour, node_colour] = kShades[i % kShades.size()];
    picture.shades.push_back({config.pheromones[i].type, colour, node_colour, 0.1});
  }
  picture.with_obstacles = true;
  for (size_t i = 0; i < record.robots.size(); ++i) {
    picture.ways.push_back({fmt::format("robot {}", i + 1), kColours[i % kColours.size()],
                            record.robots[i].track, i < kColours.size()});
  }
  return Draw(picture, field::Field(config), 0);
}

}  // namespace pheromone::swarm
