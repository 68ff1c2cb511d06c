#include "server/core/engine/config_hash.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <set>

#include "server/core/engine/testing/bench.h"
#include "server/core/petri/testing/live_gate.h"

namespace pheromone::engine {
namespace {

using Change = std::function<void(EngineConfig&)>;

field::Shared<std::vector<field::InitialNode>> Nodes(std::vector<field::InitialNode> nodes) {
  return field::Shared(std::move(nodes));
}

field::Shared<field::ObstacleMask> Wall(const EngineConfig& config, int32_t row) {
  field::ObstacleMask mask(config.field.map.columns(), config.field.map.rows());
  mask.BlockRow(row, 3, 9);
  return field::Shared(std::move(mask));
}

// No list is empty.
EngineConfig FullConfig() {
  EngineConfig config = testing::SmallConfig();
  field::PheromoneLaw blend;
  blend.type = 3;
  blend.name = "both";
  blend.blend = {{1, 1000}, {2, -500}};
  config.field.pheromones.push_back(blend);
  config.field.paths = {{1, 2, false, {{0, 0}, {5, 5}}}, {2, 1, false, {{7, 7}}}};
  config.field.initial_rasters = {{1, Nodes({{{1, 2}, 64}, {{2, 2}, 128}})}};
  config.field.obstacles = Wall(config, 4);
  config.frames = {MakeFrame("radio-a", 3, {10, 20}, 30)};
  config.tags = {.tags = {{"door", 1, 2, 3, 4}}, .privileged = {"ann"}};
  config.nets = {petri::LiveGateSettings()};
  return config;
}

// Does not compile once a field is added: it belongs in the hash, and below.
[[maybe_unused]] void NameEveryField(const EngineConfig& config) {
  [[maybe_unused]] const auto& [field, pose_unit_10um, links, frames, tags, nets] = config;
  [[maybe_unused]] const auto& [name, slot_ms, response_window_ms] = links[0];
  [[maybe_unused]] const auto& [link, id, x_um, y_um, heading, cos_q30, sin_q30] = frames[0];
  [[maybe_unused]] const auto& [map, antennas, pheromones, paths, prints, obstacles, memory_bytes] =
      field;
  [[maybe_unused]] const auto& [origin, width_um, height_um, cell_um] = map;
  [[maybe_unused]] const auto& [distance_um, forward_um, angle] = antennas;
  [[maybe_unused]] const auto& [type, law_name, profile, core_um, sigma_um, cutoff_um, evaporation,
                                tau_ms, quantum_micro, max_count, directional, weight_milli,
                                diffusion, blend] = pheromones[0];
  [[maybe_unused]] const auto& [exchange_q16, step_ms, keep_q32, cutoff_q16] = diffusion;
  [[maybe_unused]] const auto& [part_type, part_weight_milli] = blend[0];
  [[maybe_unused]] const auto& [path_type, count, closed, points] = paths[0];
  [[maybe_unused]] const auto& [print_type, nodes] = prints[0];
  [[maybe_unused]] const auto& [node, level] = (*nodes)[0];
}

// One change for each field that there is.
std::map<std::string, Change> EveryChange() {
  using C = EngineConfig;
  return {
      {"tag's name", [](C& c) { c.tags.tags[0].name += "'"; }},
      {"tag's x", [](C& c) { ++c.tags.tags[0].x_um; }},
      {"tag's y", [](C& c) { ++c.tags.tags[0].y_um; }},
      {"tag's range", [](C& c) { ++c.tags.tags[0].range_um; }},
      {"tag's slots", [](C& c) { ++c.tags.tags[0].slots; }},
      {"fewer tags", [](C& c) { c.tags.tags.clear(); }},
      {"privileged", [](C& c) { c.tags.privileged[0] += "'"; }},
      {"nobody privileged", [](C& c) { c.tags.privileged.clear(); }},
      {"net's name", [](C& c) { c.nets[0].name += "'"; }},
      {"net's robots", [](C& c) { ++c.nets[0].robot_hash; }},
      {"net's period", [](C& c) { ++c.nets[0].period_ms; }},
      {"net's law", [](C& c) { c.nets[0].law = petri::EvaporationLaw::kE4; }},
      {"net's rate", [](C& c) { ++c.nets[0].rate_milli; }},
      {"net's dead band", [](C& c) { ++c.nets[0].dead_band_milli; }},
      {"net has a source", [](C& c) { c.nets[0].has_source = !c.nets[0].has_source; }},
      {"net's source", [](C& c) { ++c.nets[0].source; }},
      {"net's tag", [](C& c) { c.nets[0].tags[0].tag += "'"; }},
      {"fewer tags of a net", [](C& c) { c.nets[0].tags.pop_back(); }},
      {"net's tokens", [](C& c) { ++c.nets[0].net.places[0].tokens; }},
      {"net's transition", [](C& c) { c.nets[0].net.transitions[0].id += "'"; }},
      {"fewer nets", [](C& c) { c.nets.clear(); }},
      {"origin.x", [](C& c) { ++c.field.map.origin.x; }},
      {"origin.y", [](C& c) { ++c.field.map.origin.y; }},
      {"width", [](C& c) { ++c.field.map.width_um; }},
      {"height", [](C& c) { ++c.field.map.height_um; }},
      {"cell", [](C& c) { ++c.field.map.cell_um; }},
      {"antenna distance", [](C& c) { ++c.field.antennas.distance_um; }},
      {"antenna forward", [](C& c) { ++c.field.antennas.forward_um; }},
      {"antenna angle", [](C& c) { ++c.field.antennas.angle; }},
      {"type", [](C& c) { c.field.pheromones[1].type = 9; }},
      {"name", [](C& c) { c.field.pheromones[0].name += "'"; }},
      {"profile", [](C& c) { c.field.pheromones[0].profile = field::Profile::kGaussian; }},
      {"core", [](C& c) { ++c.field.pheromones[0].core_um; }},
      {"sigma", [](C& c) { ++c.field.pheromones[0].sigma_um; }},
      {"cutoff", [](C& c) { ++c.field.pheromones[0].cutoff_um; }},
      {"linear", [](C& c) { c.field.pheromones[0].evaporation = field::Evaporation::kLinear; }},
      {"half", [](C& c) { c.field.pheromones[0].evaporation = field::Evaporation::kExponential; }},
      {"tau", [](C& c) { ++c.field.pheromones[0].tau_ms; }},
      {"quantum", [](C& c) { ++c.field.pheromones[0].quantum_micro; }},
      {"max_count", [](C& c) { ++c.field.pheromones[0].max_count; }},
      {"directional", [](C& c) { c.field.pheromones[0].directional = false; }},
      {"weight", [](C& c) { c.field.pheromones[0].weight_milli = -1000; }},
      {"exchange", [](C& c) { ++c.field.pheromones[0].diffusion.exchange_q16; }},
      {"step", [](C& c) { ++c.field.pheromones[0].diffusion.step_ms; }},
      {"keep", [](C& c) { ++c.field.pheromones[0].diffusion.keep_q32; }},
      {"diffusion cutoff", [](C& c) { ++c.field.pheromones[0].diffusion.cutoff_q16; }},
      {"part's type", [](C& c) { c.field.pheromones[2].blend[0].type = 2; }},
      {"part's weight", [](C& c) { ++c.field.pheromones[2].blend[1].weight_milli; }},
      {"fewer parts", [](C& c) { c.field.pheromones[2].blend.pop_back(); }},
      {"fewer pheromones", [](C& c) { c.field.pheromones.pop_back(); }},
      {"path's type", [](C& c) { c.field.paths[0].type = 2; }},
      {"path's count", [](C& c) { ++c.field.paths[0].count; }},
      {"path closed", [](C& c) { c.field.paths[0].closed = true; }},
      {"path's x", [](C& c) { ++c.field.paths[0].points[1].x; }},
      {"path's y", [](C& c) { ++c.field.paths[0].points[1].y; }},
      {"point to the next path",
       [](C& c) {
         c.field.paths[0].points.pop_back();
         c.field.paths[1].points.insert(c.field.paths[1].points.begin(), {5, 5});
       }},
      {"fewer paths", [](C& c) { c.field.paths.pop_back(); }},
      {"print's type", [](C& c) { c.field.initial_rasters[0].type = 2; }},
      {"print's level",
       [](C& c) {
         c.field.initial_rasters[0].nodes = Nodes({{{1, 2}, 64}, {{2, 2}, 1}});
       }},
      {"print's column",
       [](C& c) {
         c.field.initial_rasters[0].nodes = Nodes({{{1, 2}, 64}, {{3, 2}, 128}});
       }},
      {"print's row",
       [](C& c) {
         c.field.initial_rasters[0].nodes = Nodes({{{1, 2}, 64}, {{2, 3}, 128}});
       }},
      {"print without nodes", [](C& c) { c.field.initial_rasters[0].nodes = {}; }},
      {"fewer prints", [](C& c) { c.field.initial_rasters.pop_back(); }},
      {"other obstacles", [](C& c) { c.field.obstacles = Wall(c, 5); }},
      {"no obstacles", [](C& c) { c.field.obstacles = {}; }},
      {"memory", [](C& c) { ++c.field.memory_bytes; }},
      {"pose unit", [](C& c) { ++c.pose_unit_10um; }},
      {"link's name", [](C& c) { c.links[0].name = "radio-c"; }},
      {"slot", [](C& c) { ++c.links[1].slot_ms; }},
      {"window", [](C& c) { ++c.links[1].response_window_ms; }},
      {"fewer links", [](C& c) { c.links.pop_back(); }},
      {"frame's link", [](C& c) { c.frames[0].link = "radio-b"; }},
      {"frame's id", [](C& c) { ++c.frames[0].id; }},
      {"frame's x", [](C& c) { ++c.frames[0].x_um; }},
      {"frame's y", [](C& c) { ++c.frames[0].y_um; }},
      {"frame's heading", [](C& c) { ++c.frames[0].heading; }},
      {"frame's cos", [](C& c) { ++c.frames[0].cos_q30; }},
      {"frame's sin", [](C& c) { ++c.frames[0].sin_q30; }},
      {"no frames", [](C& c) { c.frames.clear(); }},
  };
}

TEST(HashConfig, TellsEveryFieldFromEveryOther) {
  std::set<uint64_t> hashes = {HashConfig(FullConfig())};
  for (const auto& [name, change] : EveryChange()) {
    EngineConfig config = FullConfig();
    change(config);
    EXPECT_FALSE(config == FullConfig()) << name;
    EXPECT_TRUE(hashes.insert(HashConfig(config)).second) << name;
  }
}

// The content counts, not its address.
TEST(HashConfig, EqualConfigurationsHaveEqualHashes) {
  EXPECT_TRUE(FullConfig() == FullConfig());
  EXPECT_EQ(HashConfig(FullConfig()), HashConfig(FullConfig()));
}

TEST(SameHello, DiffersExactlyWhereHelloTellsSomethingElse) {
  const std::set<std::string> told = {"antenna distance", "type",       "fewer pheromones",
                                      "pose unit",        "slot",       "window",
                                      "link's name",      "fewer links"};
  for (const auto& [name, change] : EveryChange()) {
    EngineConfig config = FullConfig();
    change(config);
    EXPECT_EQ(SameHello(config, FullConfig()), !told.contains(name)) << name;
  }
}

TEST(TypeMask, HasABitForEachTypeBlendsIncluded) {
  EXPECT_EQ(TypeMaskOf(FullConfig().field), 0b1110);
}

}  // namespace
}  // namespace pheromone::engine
