#include "server/operators/ctl/mcap_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "server/base/descriptor.h"
#include "server/core/field/field.h"
#include "server/formats/foxglove/messages.h"
#include "server/formats/foxglove/pheromone_raster.h"
#include "server/formats/foxglove/schema.h"
#include "server/formats/mcap/writer.h"
#include "server/operators/control/control.h"
#include "server/operators/control/json_text.h"
#include "server/operators/control/names.h"
#include "server/operators/control/scenes.h"
#include "server/operators/ctl/export_recording.h"
#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {
namespace {

constexpr uint64_t kNsPerMs = 1'000'000;
constexpr uint64_t kStepNs = 100 * kNsPerMs;       // of poses
constexpr uint64_t kSlowStepNs = 1000 * kNsPerMs;  // of trails and of what seldom changes
// A longer silence is not filled with pictures of evaporation: the clock was set, or nobody was
// there.
constexpr uint64_t kLongestSilenceNs = uint64_t{3600} * 1000 * kNsPerMs;

// The messages of one file.
class Show : public RecordingExport {
 public:
  Show(mcap::Writer* writer, uint64_t grid_step_ns)
      : writer_(*writer), grid_step_ns_(grid_step_ns) {}

  // Everything is new: the engine is another one.
  void Begin(const playback::Player* player) override {
    player_ = player;
    rasters_.clear();
    config_.reset();
    robots_ = {};
    next_ns_ = 0;
  }

  void Until(uint64_t until_ns) override {
    if (next_ns_ == 0 || until_ns > next_ns_ + kLongestSilenceNs) {
      next_ns_ = until_ns;
      origin_ns_ = until_ns;
    }
    for (; next_ns_ < until_ns; next_ns_ += kStepNs) {
      At(next_ns_);
    }
  }

  // At the end of a recording everything is shown, whatever is due.
  void End(uint64_t end_ns) override { At(end_ns, true); }

  void At(uint64_t time_ns, bool is_end = false) {
    const playback::Player& player = *player_;
    const engine::Engine& engine = player.engine();
    const bool is_new = config_ != engine.shared_config();
    if (is_new) {
      config_ = engine.shared_config();
      rasters_.clear();
    }
    const control::FieldView view = player.Field(time_ns);
    const std::vector<control::ClientView> clients = player.Clients(time_ns);
    const uint64_t since_ns = time_ns - origin_ns_;
    Write("/robots", foxglove::kSceneUpdateSchema, time_ns,
          robots_.Robots(clients, view.config, time_ns));
    Write("/clients", "", time_ns, web::ToText(web::ClientsWithAntennas(clients, view)));
    if (since_ns % kSlowStepNs == 0 || is_new || is_end) {
      Write("/tf", foxglove::kFrameTransformsSchema, time_ns,
            web::RobotScenes::Transforms(clients, time_ns));
      Write("/trails", foxglove::kSceneUpdateSchema, time_ns, robots_.Trails(clients, time_ns));
      Write("/goals", foxglove::kSceneUpdateSchema, time_ns,
            web::RobotScenes::Goals(clients, time_ns));
    }
    if (is_new) {
      Write("/obstacles", foxglove::kGridSchema, time_ns, web::ObstacleGrid(view.config, time_ns));
      Write("/tags", foxglove::kSceneUpdateSchema, time_ns,
            web::TagScenes::Places(player.Tags(time_ns), time_ns));
    }
    if (is_new || is_end || since_ns % grid_step_ns_ < kStepNs) {
      Grids(view, time_ns);
    }
  }

  void Note(const capture::Record& record) override {
    const std::vector<capture::LinkInfo>& links = player_->start().links;
    const auto* const batch = std::get_if<capture::Batch>(&record);
    for (size_t i = 0; batch != nullptr && i < batch->messages.size(); ++i) {
      const protocol::Message& message = batch->messages[i].message;
      protocol::EventReport event;
      if (protocol::Decode(message, &event)) {
        const uint64_t time_ns =
            static_cast<uint64_t>(std::max<int64_t>(batch->stamp.utc_ms, 0)) * kNsPerMs;
        const foxglove::Log log = foxglove::MakeLog(
            foxglove::Log::INFO, batch->link < links.size() ? links[batch->link].name : "?",
            fmt::format("robot {}: {} {}", int{message.id}, web::NameOf(event.code),
                        event.argument),
            time_ns);
        Write("/events", foxglove::kLogSchema, time_ns, log.SerializeAsString());
      }
    }
  }

  bool has_failed() const override { return !status_.ok(); }
  const Status& status() const { return status_; }

 private:
  void Write(const std::string& topic, std::string_view schema, uint64_t time_ns,
             std::string_view message) {
    auto found = channels_.find(topic);
    if (found == channels_.end()) {
      mcap::Channel channel;
      channel.topic = topic;
      channel.encoding = schema.empty() ? "json" : "protobuf";
      if (!schema.empty()) {
        channel.schema_name = schema;
        channel.schema_encoding = "protobuf";
        channel.schema = foxglove::SchemaOf(schema);
      }
      found = channels_.emplace(topic, writer_.AddChannel(channel)).first;
    }
    status_ = writer_.Write(found->second, time_ns, message);
  }

  void Grids(const control::FieldView& view, uint64_t time_ns) {
    const field::FieldReader reader(*view.field);
    for (const field::PheromoneLaw& law : view.config.pheromones) {
      if (law.is_blend() || !reader.ok()) {
        continue;
      }
      auto& raster = rasters_[law.type];
      if (raster == nullptr) {
        raster = std::make_unique<web::PheromoneRaster>(view.config, law.type);
      }
      if (!raster->Update(reader, view.now_ms, true)) {
        continue;
      }
      Write("/pheromone/" + law.name, foxglove::kGridSchema, time_ns, raster->EncodeGrid(time_ns));
    }
  }

  mcap::Writer& writer_;
  const uint64_t grid_step_ns_;
  const playback::Player* player_ = nullptr;
  std::map<std::string, uint16_t> channels_;
  std::map<uint8_t, std::unique_ptr<web::PheromoneRaster>> rasters_;
  std::optional<engine::SharedConfig> config_;
  web::RobotScenes robots_;
  uint64_t origin_ns_ = 0;
  uint64_t next_ns_ = 0;
  Status status_ = Ok();
};

}  // namespace

int ExportMcap(const std::vector<std::string>& captures, const McapOptions& options) {
  std::FILE* const file = std::fopen(options.out.c_str(), "wbe");
  if (file == nullptr) {
    return Fail(kFailed, SystemError(options.out));
  }
  uint64_t bytes = 0;
  mcap::Writer writer(
      [&](std::string_view part) -> Status {
        bytes += part.size();
        return std::fwrite(part.data(), 1, part.size(), file) == part.size()
                   ? Ok()
                   : Status(SystemError(options.out));
      },
      "pheromonectl " PHEROMONE_VERSION);
  Show show(&writer, std::max(kStepNs, static_cast<uint64_t>(1e9 / options.grid_hz)));
  Status exported = ExportRecordings(captures, &show);
  if (exported.ok()) {
    exported = show.status();
  }
  Status written = writer.Finish();
  if (std::fclose(file) != 0 && written.ok()) {
    written = SystemError(options.out);
  }
  if (!written.ok()) {
    std::remove(options.out.c_str());
    return Fail(kFailed, written.error());
  }
  if (!exported.ok()) {
    return Fail(kFailed, fmt::format("{}\n  {} has {} messages up to there", exported.error(),
                                     options.out, writer.messages()));
  }
  std::cout << fmt::format("{}: {} messages, {} bytes\n", options.out, writer.messages(), bytes);
  return 0;
}

}  // namespace pheromone::ctl
