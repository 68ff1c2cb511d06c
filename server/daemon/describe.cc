#include "server/daemon/describe.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "protocol/opcodes.h"
#include "server/field/path.h"

namespace pheromone::daemon {
namespace {

double Metres(int64_t um) {
  return static_cast<double>(um) / 1e6;
}

double Degrees(uint16_t binary_angle) {
  return binary_angle * 360.0 / 65536;
}

double Seconds(int64_t ms) {
  return static_cast<double>(ms) / 1e3;
}

std::string DescribeAntennas(const field::AntennaGeometry& antennas) {
  std::string text = fmt::format("antennas {} m apart", Metres(antennas.distance_um));
  if (antennas.angle != field::AntennaGeometry{}.angle) {
    text = fmt::format("antennas {} m from the centre at {:.2f} deg",
                       Metres(antennas.distance_um) / 2, Degrees(antennas.angle));
  }
  if (antennas.forward_um != 0) {
    text += fmt::format(", {} m ahead", Metres(antennas.forward_um));
  }
  return text;
}

std::string DescribeMap(const field::FieldConfig& field) {
  const field::MapGeometry& map = field.map;
  return fmt::format("map: {} m x {} m from ({}, {}), {} x {} nodes, one every {} m; {}",
                     Metres(map.width_um), Metres(map.height_um), Metres(map.origin.x),
                     Metres(map.origin.y), map.columns(), map.rows(), Metres(map.cell_um),
                     DescribeAntennas(field.antennas));
}

std::string DescribeEvaporation(const field::PheromoneLaw& law) {
  if (law.tau_ms == 0) {
    return "never evaporates";
  }
  switch (law.evaporation) {
    case field::Evaporation::kCounter:
      return fmt::format("one quantum less every {} s", Seconds(law.tau_ms));
    case field::Evaporation::kLinear:
      return fmt::format("one quantum less every {} s, evenly", Seconds(law.tau_ms));
    case field::Evaporation::kExponential:
      break;
  }
  return fmt::format("half of it every {} s", Seconds(law.tau_ms));
}

std::string DescribeSpread(const field::PheromoneLaw& law) {
  if (law.profile == field::Profile::kGaussian) {
    return fmt::format("a bell of {} m smelled to {} m", Metres(law.sigma_um),
                       Metres(law.cutoff_um));
  }
  return law.core_um == 0 ? fmt::format("a cone smelled to {} m", Metres(law.reach_um()))
                          : fmt::format("full to {} m and smelled to {} m", Metres(law.core_um),
                                        Metres(law.reach_um()));
}

std::string DescribeLaw(const field::FieldConfig& field, const field::PheromoneLaw& law) {
  std::string line = fmt::format("pheromone {} \"{}\": ", law.type, law.name);
  if (law.is_blend()) {
    line += "a blend of";
    for (size_t i = 0; i < law.blend.size(); ++i) {
      const field::BlendPart& part = law.blend[i];
      line += fmt::format("{} {} x \"{}\"", i == 0 ? "" : ",", part.weight_milli / 1e3,
                          field.FindLaw(part.type)->name);
    }
    return line;
  }
  const double quantum = static_cast<double>(law.quantum_micro) / 1e6;
  line +=
      fmt::format("quantum {}, at most {}, {}, {}{}", quantum, quantum * law.max_count,
                  DescribeEvaporation(law), DescribeSpread(law), law.directional ? " ahead" : "");
  if (law.weight_milli != 1000) {
    line += fmt::format(", {} {}", law.weight_milli < 0 ? "repels with weight" : "weight",
                        law.weight_milli / 1e3);
  }
  if (law.diffuses()) {
    line += fmt::format(", spreads: {:.2f} % of each difference every {} s",
                        law.diffusion.exchange_q16 / 655.36, Seconds(law.diffusion.step_ms));
  }
  return line;
}

std::string_view NameOf(protocol::Reason reason) {
  switch (reason) {
    case protocol::Reason::kUnknownOpcode:
      return "unknown opcode";
    case protocol::Reason::kBadLength:
      return "bad length";
    case protocol::Reason::kOffTheMap:
      return "off the map";
    case protocol::Reason::kUnknownPheromone:
      return "unknown pheromone";
    case protocol::Reason::kSequenceReused:
      return "sequence reused";
    case protocol::Reason::kSayHello:
      return "say hello";
    case protocol::Reason::kBusy:
      return "busy";
    case protocol::Reason::kReadOnly:
      return "read-only";
    case protocol::Reason::kMapFull:
      return "map full";
    case protocol::Reason::kNotPermitted:
      return "not permitted";
    case protocol::Reason::kBadValue:
      return "bad value";
    case protocol::Reason::kBlockedByObstacle:
      return "blocked by obstacle";
    default:
      return "other";
  }
}

}  // namespace

std::vector<std::string> DescribeConfig(const config::Config& config) {
  const field::FieldConfig& field = config.engine.field;
  std::vector<std::string> lines = {DescribeMap(field)};
  if (const auto& datum = config.datum) {
    lines.push_back(fmt::format("datum: latitude {} deg, longitude {} deg, height {} m",
                                datum->latitude_deg, datum->longitude_deg, datum->height_m));
  }
  for (const field::PheromoneLaw& law : field.pheromones) {
    lines.push_back(DescribeLaw(field, law));
  }
  if (field.obstacles) {
    lines.push_back(fmt::format("obstacles: {} nodes blocked", field.obstacles->count()));
  }
  for (const field::Path& path : field.paths) {
    lines.push_back(fmt::format("path of type {}: {:.1f} m{}", path.type,
                                field::LengthOf(path) / 1e6, path.closed ? ", closed" : ""));
  }
  for (const field::Print& print : field.prints) {
    lines.push_back(fmt::format("print of type {}: {} nodes", print.type, print.nodes->size()));
  }
  for (const engine::RobotFrame& frame : config.engine.frames) {
    lines.push_back(fmt::format("robot {} on link {} counts from ({}, {}), turned by {:.2f} deg",
                                frame.id, frame.link, Metres(frame.x_um), Metres(frame.y_um),
                                Degrees(frame.heading)));
  }
  return lines;
}

std::vector<std::string> DescribeCounters(const engine::ServiceCounters& counters) {
  std::vector<std::string> lines = {fmt::format(
      "requests {}, answers {} ({} repeated), changes {}, ignored {}", counters.requests,
      counters.answers, counters.repeats, counters.changes, counters.ignored)};
  std::string errors;
  for (size_t reason = 0; reason < counters.errors.size(); ++reason) {
    if (counters.errors[reason] != 0) {
      errors += fmt::format("{}{} {}", errors.empty() ? "" : ", ",
                            NameOf(static_cast<protocol::Reason>(reason)), counters.errors[reason]);
    }
  }
  lines.push_back("errors: " + (errors.empty() ? "none" : errors));
  return lines;
}

std::string DescribeTrouble(const engine::EngineCounters& counters) {
  const std::array<std::pair<std::string_view, uint64_t>, 4> troubles = {{
      {"ID conflicts (two robots under one ID)", counters.id_conflicts},
      {"robots forgotten to make room", counters.robots_forgotten},
      {"commands unanswered", counters.commands_unanswered},
      {"commands with unknown outcome (the robot restarted)", counters.commands_unknown},
  }};
  std::string text;
  for (const auto& [what, count] : troubles) {
    if (count != 0) {
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", what, count);
    }
  }
  return text;
}

std::string DescribeLink(const std::string& name, const links::LinkCounters& counters) {
  std::string line = fmt::format("link {}: {} frames in {} bytes received, {} in {} bytes sent",
                                 name, counters.received.frames, counters.bytes_in,
                                 counters.frames_out, counters.bytes_out);
  const std::array<std::pair<std::string_view, uint64_t>, 17> losses = {{
      {"damaged", counters.received.crc_errors},
      {"bad escapes", counters.received.bad_escapes},
      {"oversize", counters.received.oversize},
      {"runts", counters.received.runts},
      {"refused", counters.received.refused},
      {"restarts", counters.received.restarts},
      {"timeouts", counters.received.timeouts},
      {"stray bytes", counters.received.ignored_bytes},
      {"late answers", counters.late_answers},
      {"dropped answers", counters.dropped_answers},
      {"withheld errors", counters.withheld_errors},
      {"undeliverable", counters.undeliverable},
      {"dropped connections", counters.dropped_connections},
      {"from clients not allowed", counters.not_allowed},
      {"too many at once", counters.too_many},
      {"oversize datagrams", counters.oversize_datagrams},
      {"opened again", counters.opened > 0 ? counters.opened - 1 : 0},
  }};
  for (const auto& [what, count] : losses) {
    if (count != 0) {
      line += fmt::format(", {} {}", what, count);
    }
  }
  return line;
}

}  // namespace pheromone::daemon
