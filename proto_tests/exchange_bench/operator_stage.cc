#include "proto_tests/exchange_bench/operator_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace pheromone::bench {
namespace {

constexpr int kRobotsNodes = 513;
constexpr int kPartNodes = 1024;  // of a part's side: an edit may touch 2^20 nodes
constexpr int kTauS = 900'000;    // nothing evaporates

// The pheromone that operators change.
constexpr std::string_view kPaint = R"([[pheromone]]
type = 3
name = "paint"
core_m = 0.05
sigma_m = 0.05
quantum = 0.125
maximum = 0.125
tau_s = {}
)";

std::string Extra(int field_mib) {
  return fmt::format(kPaint, kTauS) +
         fmt::format(
             "[limits]\nfield_memory_mib = {}\n[journal]\nfolder = \"state\"\n"
             "[capture]\nfolder = \"captures\"\nmax_mb = {}\nmax_files = 1\n",
             field_mib, 16 * field_mib);
}

}  // namespace

int SideBeyond(int field_mib) {
  constexpr double kLeastBytesPerNode = 8;
  return static_cast<int>(std::sqrt(1.1 * field_mib * 1048576 / kLeastBytesPerNode));
}

OperatorStage::OperatorStage(const OperatorOptions& options, int nodes)
    : options_(options),
      nodes_(nodes),
      folder_(options.folder),
      arena_(MakeArena(folder_, {1, 2}, Extra(options.field_mib), {nodes, kRobotsNodes})),
      watchdog_(folder_) {}

OperatorStage::~OperatorStage() {
  robots_.reset();
  if (server_ != nullptr) {
    server_->Kill();
  }
}

void OperatorStage::Restart() {
  robots_.reset();
  if (server_ != nullptr) {
    server_->Kill();
    server_.reset();
  }
  for (const char* name : {"state", "captures", "pty-1", "pty-2", "pheromoned.sock"}) {
    std::filesystem::remove_all(folder_ + "/" + name);
  }
  std::ofstream(arena_.config_file) << arena_.config_text;
  server_ =
      std::make_unique<ServerProcess>(options_.pheromoned, arena_.config_file,
                                      std::vector<std::string>{}, folder_, watchdog_.environment());
}

SteadyRobots& OperatorStage::robots() {
  if (robots_ == nullptr) {
    robots_ = std::make_unique<SteadyRobots>(
        arena_, std::array{folder_ + "/pty-1", folder_ + "/pty-2"}, server_->PortOf("udp-1"));
  }
  return *robots_;
}

HttpAnswer OperatorStage::Post(std::string_view target, std::string_view body) const {
  return Call(folder_ + "/pheromoned.sock", "POST", target, body, options_.patience);
}

HttpAnswer OperatorStage::Get(std::string_view target) const {
  return Call(folder_ + "/pheromoned.sock", "GET", target, "", options_.patience);
}

HttpAnswer OperatorStage::Reload(int tau_s, const std::string& more) {
  std::string text = arena_.config_text;
  const std::string before = fmt::format("tau_s = {}\n", kTauS);
  text.replace(text.find(before), before.size(), fmt::format("tau_s = {}\n", tau_s));
  std::ofstream(arena_.config_file) << text << more;
  return Post("/api/v1/reload", "{}");
}

int OperatorStage::Fill() const {
  int parts = 0;
  const auto metres = [](int node) { return node * kCellMm / 1000.0; };
  for (int row = 0; row < nodes_; row += kPartNodes) {
    for (int column = 0; column < nodes_; column += kPartNodes) {
      const HttpAnswer painted =
          Post("/api/v1/paint",
               fmt::format(
                   R"({{"pheromone": "paint", "area_m": [{:.3f}, {:.3f}, {:.3f}, {:.3f}]}})",
                   metres(column), metres(row), metres(std::min(column + kPartNodes, nodes_) - 1),
                   metres(std::min(row + kPartNodes, nodes_) - 1)));
      if (painted.status != 200) {
        return parts;
      }
      ++parts;
    }
  }
  return parts;
}

double OperatorStage::StatusNumber(std::string_view key) const {
  const std::string status = Get("/api/v1/status").body;
  const size_t at = status.find(fmt::format("\"{}\":", key));
  return at == std::string::npos ? 0 : std::atof(status.c_str() + at + key.size() + 3);
}

}  // namespace pheromone::bench
