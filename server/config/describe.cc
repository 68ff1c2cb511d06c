#include "server/config/describe.h"

#include <fmt/format.h>

#include "server/base/units.h"
#include "server/config/folders.h"
#include "server/core/field/path.h"

namespace pheromone::config {
namespace {

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
      return fmt::format("loses one quantum every {} s", Seconds(law.tau_ms));
    case field::Evaporation::kLinear:
      return fmt::format("loses one quantum every {} s in steps of 1/64", Seconds(law.tau_ms));
    case field::Evaporation::kExponential:
      break;
  }
  return fmt::format("halves every {} s", Seconds(law.tau_ms));
}

std::string DescribeSpread(const field::PheromoneLaw& law) {
  if (law.profile == field::Profile::kGaussian) {
    return fmt::format("Gaussian of sigma {} m sensed up to {} m", Metres(law.sigma_um),
                       Metres(law.cutoff_um));
  }
  return law.core_um == 0 ? fmt::format("a cone sensed up to {} m", Metres(law.reach_um()))
                          : fmt::format("full up to {} m and sensed up to {} m",
                                        Metres(law.core_um), Metres(law.reach_um()));
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
    line += fmt::format(", diffuses: {:.2f} % of each difference every {} s",
                        law.diffusion.exchange_q16 / 655.36, Seconds(law.diffusion.step_ms));
  }
  return line;
}

// One by one if they are few.
void AddTags(const engine::EngineConfig& config, std::vector<std::string>* lines) {
  constexpr size_t kFew = 16;
  const std::vector<tags::TagSettings>& tags = config.tags.tags;
  if (tags.size() > kFew) {
    lines->push_back(fmt::format("tags: {}", tags.size()));
    return;
  }
  for (const tags::TagSettings& tag : tags) {
    lines->push_back(fmt::format("tag \"{}\" at ({}, {}), {} slots, in range up to {} m", tag.name,
                                 Metres(tag.x_um), Metres(tag.y_um), tag.slots,
                                 Metres(tag.range_um)));
  }
}

void AddNets(const engine::EngineConfig& config, std::vector<std::string>* lines) {
  for (const petri::LiveSettings& net : config.nets) {
    lines->push_back(fmt::format(
        "net \"{}\": {}, {} places, {} transitions, {} tags, read every {} ms; law {}, rate {}, "
        "dead band {}, source {}",
        net.name, net.net.name, net.net.places.size(), net.net.transitions.size(), net.tags.size(),
        net.period_ms, petri::NameOf(net.law), net.rate_milli / 1e3, net.dead_band_milli / 1e3,
        net.has_source ? fmt::format("{}", net.source) : "endless"));
  }
}

}  // namespace

std::vector<std::string> DescribeConfig(const Config& config) {
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
  for (const field::InitialRaster& print : field.initial_rasters) {
    lines.push_back(
        fmt::format("initial raster of type {}: {} nodes", print.type, print.nodes->size()));
  }
  AddTags(config.engine, &lines);
  AddNets(config.engine, &lines);
  for (const engine::RobotFrame& frame : config.engine.frames) {
    lines.push_back(
        fmt::format("frame of robot {} on link {}: origin ({}, {}), turned by {:.2f} deg", frame.id,
                    frame.link, Metres(frame.x_um), Metres(frame.y_um), Degrees(frame.heading)));
  }
  return lines;
}

CheckReport DescribeCheck(const std::string& name, const Config& config,
                          const char* state_directory) {
  const FolderReport folders = LookAtFolders(config, state_directory);
  CheckReport report;
  for (const Warning& warning : config.warnings) {
    report.warnings += "warning: " + warning.text + '\n';
  }
  for (const std::string& warning : folders.warnings) {
    report.warnings += "warning: " + warning + '\n';
  }
  for (const std::string& error : folders.errors) {
    report.errors += name + ": " + error + '\n';
  }
  if (!report.errors.empty()) {
    return report;
  }
  report.text = name + ": ok\n";
  const std::vector<std::string> described = DescribeConfig(config);
  const std::vector<std::string> reach = DescribeReach(config, nullptr);
  for (const auto* lines : {&described, &reach, &folders.lines}) {
    for (const std::string& line : *lines) {
      report.text += "  " + line + '\n';
    }
  }
  for (const std::string& note : config.notes) {
    report.text += "  note: " + note + '\n';
  }
  if (state_directory == nullptr) {
    report.text +=
        "  a systemd service resolves relative paths differently: the journal and recordings from "
        "its state directory, ptys and the control socket from its runtime directory\n";
  }
  return report;
}

}  // namespace pheromone::config
