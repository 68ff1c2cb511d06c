#include "proto_tests/exchange_bench/arena.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <random>

#include "proto_tests/exchange_bench/fail.h"
#include "protocol/opcodes.h"
#include "server/config/config.h"
#include "server/core/engine/engine.h"

namespace pheromone::bench {
namespace {

constexpr uint8_t kType = 1;
constexpr uint8_t kFadingType = 2;
constexpr size_t kPoses = 1u << 16;  // more than caches hold of the map

constexpr std::string_view kConfig = R"([map]
width_m = {0:.3f}
height_m = {0:.3f}
cell_m = 0.02
wide = {1}
[antennas]
bias_m = 0.04
[[pheromone]]
type = 1
name = "trail"
core_m = 0.05
sigma_m = 0.05          # sensed up to 0.1 m: r = 5 cells
tau_s = 1000000
quantum = 0.125
maximum = 0.125
[[pheromone]]
type = 2
name = "fading"
core_m = 0.05
sigma_m = 0.05
tau_s = 1.0
quantum = 0.125
maximum = 0.25          # gone after two seconds
[[print]]
pheromone = "trail"
file = "nodes.pgm"
[daemon]
io_threads = 1
)";

// Of a square; by row from below, then by column: whether the node holds something.
struct Nodes {
  explicit Nodes(int nodes_per_side)
      : side(static_cast<size_t>(nodes_per_side)), hold(side * side, true) {}

  size_t side;
  std::vector<bool> hold;
};

Nodes RandomNodes(int side, std::mt19937* random) {
  Nodes nodes(side);
  for (auto node : nodes.hold) {
    node = ((*random)() & 1u) != 0;
  }
  return nodes;
}

void WritePicture(const Nodes& nodes, const std::string& path) {
  std::ofstream picture(path, std::ios::binary);
  picture << "P5\n" << nodes.side << ' ' << nodes.side << "\n255\n";
  for (size_t row = nodes.side; row-- > 0;) {  // the first row of a picture is the top one
    for (size_t column = 0; column < nodes.side; ++column) {
      picture.put(nodes.hold[row * nodes.side + column] ? '\xFF' : '\0');
    }
  }
}

std::vector<protocol::WirePose> RandomPoses(const Nodes& nodes, std::mt19937* random) {
  std::uniform_int_distribution<int32_t> anywhere_mm(
      0, (static_cast<int32_t>(nodes.side) - 1) * kCellMm);
  std::uniform_int_distribution<int> any_heading(0, UINT16_MAX);
  const auto nearest = [](int32_t mm) { return static_cast<size_t>((mm + kCellMm / 2) / kCellMm); };
  std::vector<protocol::WirePose> poses;
  while (poses.size() < kPoses) {
    const int32_t x = anywhere_mm(*random);
    const int32_t y = anywhere_mm(*random);
    if (nodes.hold[nearest(y) * nodes.side + nearest(x)]) {
      poses.push_back({x, y, static_cast<uint16_t>(any_heading(*random))});
    }
  }
  return poses;
}

void ComputeAnswers(const config::Config& config, Arena* arena) {
  engine::Engine engine;
  std::vector<engine::Outgoing> out;
  engine.Apply(1, {0, 0}, engine::ConfigChanged{config.engine, 1}, &out);
  for (size_t pose = 0; pose < arena->poses.size(); ++pose) {
    out.clear();
    engine.Answer({0, 0}, 0, arena->Sense(1, pose), &out);
    if (out.size() != 1 || out[0].message.length != 4) {
      Fail("the engine does not answer");
    }
    std::array<uint8_t, 4>& answer = arena->answers.emplace_back();
    std::copy_n(out[0].message.data, answer.size(), answer.begin());
  }
}

std::string Links(const LinkNumbers& links) {
  std::string text;
  for (int i = 1; i <= links.udp; ++i) {
    text +=
        fmt::format("[[link]]\nname = \"udp-{}\"\nkind = \"udp\"\nlisten = \"127.0.0.1:0\"\n", i);
  }
  for (int i = 1; i <= links.pty; ++i) {
    text += fmt::format("[[link]]\nname = \"pty-{}\"\nkind = \"pty\"\npath = \"pty-{}\"\n", i, i);
  }
  return text;
}

}  // namespace

Arena MakeArena(const std::string& folder, const LinkNumbers& links, const std::string& extra,
                const MapSize& size) {
  std::mt19937 random(1);
  const Nodes nodes = RandomNodes(size.robots, &random);
  WritePicture(nodes, folder + "/nodes.pgm");
  Arena arena;
  arena.config_file = folder + "/bench.toml";
  const int side_mm = (size.map - 1) * kCellMm;
  arena.config_text =
      fmt::format(kConfig, side_mm / 1000.0, side_mm > INT16_MAX) + Links(links) + extra;
  std::ofstream(arena.config_file) << arena.config_text;
  const Result<config::Config> config = config::LoadConfig(arena.config_file);
  if (!config.ok()) {
    Fail(config.error());
  }
  arena.live_nodes = static_cast<size_t>(std::count(nodes.hold.begin(), nodes.hold.end(), true));
  arena.poses = RandomPoses(nodes, &random);
  ComputeAnswers(config.value(), &arena);
  return arena;
}

void WriteWhitePicture(int side, const std::string& path) {
  WritePicture(Nodes(side), path);
}

protocol::Message Arena::Sense(uint8_t client, size_t pose) const {
  protocol::Message message;
  protocol::Encode(protocol::SenseRequest{client, kType, false, poses[pose]}, &message);
  return message;
}

protocol::Message Arena::Trace(uint8_t client, size_t pose, uint8_t seq) const {
  protocol::Message message;
  protocol::Encode(protocol::TraceRequest{client, kType, false, seq, poses[pose]}, &message);
  return message;
}

protocol::Message Arena::Roam(uint8_t client, size_t pose, uint8_t seq) const {
  protocol::Message message;
  protocol::Encode(protocol::TraceRequest{client, kFadingType, false, seq, poses[pose]}, &message);
  return message;
}

bool Arena::IsSenseAnswer(const protocol::Message& answer, uint8_t client, size_t pose) const {
  return answer.id == client &&
         answer.opcode == (protocol::kFromServer | protocol::kSense | kType) &&
         answer.length == 4 && std::equal(answers[pose].begin(), answers[pose].end(), answer.data);
}

bool Arena::IsTraceAnswer(const protocol::Message& answer, uint8_t client, size_t pose,
                          uint8_t seq) const {
  return answer.id == client &&
         answer.opcode == (protocol::kFromServer | protocol::kTrace | kType) &&
         answer.length == 5 && answer.data[0] == seq &&
         std::equal(answers[pose].begin(), answers[pose].end(), answer.data + 1);
}

bool Arena::IsRoamAnswer(const protocol::Message& answer, uint8_t client, uint8_t seq) {
  return answer.id == client &&
         answer.opcode == (protocol::kFromServer | protocol::kTrace | kFadingType) &&
         answer.length == 5 && answer.data[0] == seq;
}

}  // namespace pheromone::bench
