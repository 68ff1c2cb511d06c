#include "server/operators/ctl/mcap_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <memory>

#include "server/base/file.h"
#include "server/formats/foxglove/messages.h"
#include "server/formats/foxglove/schema.h"
#include "server/formats/mcap/writer.h"
#include "server/operators/control/json_text.h"
#include "server/operators/control/names.h"
#include "server/operators/control/scenes.h"
#include "server/operators/ctl/export_recording.h"
#include "server/operators/ctl/mcap_show.h"
#include "server/operators/ctl/ros2_show.h"
#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {
namespace {

// What a viewer of the running server would have been shown.
class FoxgloveShow : public McapShow {
 public:
  using McapShow::McapShow;

  void Note(const capture::Record& record) override {
    const std::vector<capture::LinkInfo>& links = player().start().links;
    const auto* const batch = std::get_if<capture::Batch>(&record);
    for (size_t i = 0; batch != nullptr && i < batch->messages.size(); ++i) {
      const protocol::Message& message = batch->messages[i].message;
      protocol::EventReport event;
      if (protocol::Decode(message, &event)) {
        const uint64_t time_ns =
            static_cast<uint64_t>(std::max<int64_t>(batch->stamp.utc_ms, 0)) * 1'000'000;
        const foxglove::Log log = foxglove::MakeLog(
            foxglove::Log::INFO, batch->link < links.size() ? links[batch->link].name : "?",
            fmt::format("robot {}: {} {}", int{message.id}, web::NameOf(event.code),
                        event.argument),
            time_ns);
        Write("/events", foxglove::kLogSchema, time_ns, log.SerializeAsString());
      }
    }
  }

 protected:
  void Forget() override { robots_ = {}; }

  void Show(const Moment& moment) override {
    const uint64_t time_ns = moment.time_ns;
    Write("/robots", foxglove::kSceneUpdateSchema, time_ns,
          robots_.Robots(moment.clients, moment.view.config, time_ns));
    Write("/clients", "", time_ns,
          web::ToText(web::ClientsWithAntennas(moment.clients, moment.view)));
    if (moment.is_slow) {
      Write("/tf", foxglove::kFrameTransformsSchema, time_ns,
            web::RobotScenes::Transforms(moment.clients, time_ns));
      Write("/trails", foxglove::kSceneUpdateSchema, time_ns,
            robots_.Trails(moment.clients, time_ns));
      Write("/goals", foxglove::kSceneUpdateSchema, time_ns,
            web::RobotScenes::Goals(moment.clients, time_ns));
    }
    if (moment.is_new) {
      Write("/obstacles", foxglove::kGridSchema, time_ns,
            web::ObstacleGrid(moment.view.config, time_ns));
      Write("/tags", foxglove::kSceneUpdateSchema, time_ns,
            web::TagScenes::Places(player().Tags(time_ns), time_ns));
    }
  }

  void ShowGrid(const field::PheromoneLaw& law, const web::PheromoneRaster& raster,
                uint64_t time_ns) override {
    Write("/pheromone/" + law.name, foxglove::kGridSchema, time_ns, raster.EncodeGrid(time_ns));
  }

  mcap::Channel ChannelOf(const std::string& topic, std::string_view schema) const override {
    if (schema.empty()) {
      return {.topic = topic, .encoding = "json"};
    }
    return {.topic = topic,
            .encoding = "protobuf",
            .schema_name = std::string(schema),
            .schema_encoding = "protobuf",
            .schema = foxglove::SchemaOf(schema)};
  }

 private:
  web::RobotScenes robots_;
};

}  // namespace

int ExportMcap(const std::vector<std::string>& captures, const McapOptions& options) {
  FileWriter file(options.out);
  if (!file.status().ok()) {
    return Fail(kFailed, file.status().error());
  }
  uint64_t bytes = 0;
  mcap::Writer writer(
      [&](std::string_view part) -> Status {
        bytes += part.size();
        file.Write(part);
        return file.status();
      },
      "pheromonectl " PHEROMONE_VERSION, options.ros2 ? "ros2" : "");
  const auto grid_step_ns = static_cast<uint64_t>(1e9 / options.grid_hz);
  std::unique_ptr<McapShow> show;
  if (options.ros2) {
    show = std::make_unique<Ros2Show>(&writer, grid_step_ns);
  } else {
    show = std::make_unique<FoxgloveShow>(&writer, grid_step_ns);
  }
  Status exported = ExportRecordings(captures, show.get());
  if (exported.ok()) {
    exported = show->status();
  }
  Status written = writer.Finish();
  const bool is_kept = exported.ok() || writer.messages() > 0;
  if (written.ok() && is_kept) {
    written = file.Commit();
  }
  if (!written.ok()) {
    return Fail(kFailed, written.error());
  }
  if (!is_kept) {
    return Fail(kFailed, exported.error());
  }
  if (!exported.ok()) {
    return Fail(kFailed, fmt::format("{}\n  {} has {} messages up to there", exported.error(),
                                     options.out, writer.messages()));
  }
  std::cout << fmt::format("{}: {} messages, {} bytes\n", options.out, writer.messages(), bytes);
  return 0;
}

}  // namespace pheromone::ctl
