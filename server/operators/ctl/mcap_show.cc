#include "server/operators/ctl/mcap_show.h"

#include <algorithm>

namespace pheromone::ctl {
namespace {

constexpr uint64_t kNsPerMs = 1'000'000;
constexpr uint64_t kStepNs = 100 * kNsPerMs;       // of poses
constexpr uint64_t kSlowStepNs = 1000 * kNsPerMs;  // of trails and of what seldom changes
// A longer silence is not filled with pictures of evaporation: the clock was set, or nobody was
// there.
constexpr uint64_t kLongestSilenceNs = uint64_t{3600} * 1000 * kNsPerMs;

}  // namespace

void McapShow::Begin(const playback::Player* player) {
  player_ = player;
  rasters_.clear();
  config_.reset();
  next_ns_ = 0;
  Forget();
}

void McapShow::Until(uint64_t until_ns) {
  if (next_ns_ == 0 || until_ns > next_ns_ + kLongestSilenceNs) {
    next_ns_ = until_ns;
    origin_ns_ = until_ns;
  }
  for (; next_ns_ < until_ns; next_ns_ += kStepNs) {
    At(next_ns_, false);
  }
}

void McapShow::At(uint64_t time_ns, bool is_end) {
  const bool is_new = config_ != player_->engine().shared_config();
  if (is_new) {
    config_ = player_->engine().shared_config();
    rasters_.clear();
  }
  const control::FieldView view = player_->Field(time_ns);
  const std::vector<control::ClientView> clients = player_->Clients(time_ns);
  const uint64_t since_ns = time_ns - origin_ns_;
  Show({.time_ns = time_ns,
        .view = view,
        .clients = clients,
        .is_new = is_new,
        .is_slow = since_ns % kSlowStepNs == 0 || is_new || is_end});
  if (is_new || is_end || since_ns % std::max(kStepNs, grid_step_ns_) < kStepNs) {
    Grids(view, time_ns);
  }
}

void McapShow::Grids(const control::FieldView& view, uint64_t time_ns) {
  const field::FieldReader reader(*view.field);
  for (const field::PheromoneLaw& law : view.config.pheromones) {
    if (law.is_blend() || !reader.ok()) {
      continue;
    }
    auto& raster = rasters_[law.type];
    if (raster == nullptr) {
      raster = std::make_unique<web::PheromoneRaster>(view.config, law.type);
    }
    if (raster->Update(reader, view.now_ms, true)) {
      ShowGrid(law, *raster, time_ns);
    }
  }
}

void McapShow::Write(const std::string& topic, std::string_view schema, uint64_t time_ns,
                     std::string_view message) {
  auto found = channels_.find(topic);
  if (found == channels_.end()) {
    found = channels_.emplace(topic, writer_.AddChannel(ChannelOf(topic, schema))).first;
  }
  status_ = writer_.Write(found->second, time_ns, message);
}

}  // namespace pheromone::ctl
