// What exports to MCAP have in common: the moments that are shown, one channel for each topic, and
// rasters of the pheromones.
//
//   class Show : public McapShow { ... };
//   Show show(&writer, grid_step_ns);
//   const Status exported = ExportRecordings(files, &show);
//
// A moment is shown ten times a second, and at the end of each recording. One thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/core/field/field.h"
#include "server/formats/foxglove/pheromone_raster.h"
#include "server/formats/mcap/writer.h"
#include "server/operators/control/control.h"
#include "server/operators/ctl/export_recording.h"

namespace pheromone::ctl {

class McapShow : public RecordingExport {
 public:
  /// The shortest time between two grids of a pheromone is `grid_step_ns`.
  McapShow(mcap::Writer* writer, uint64_t grid_step_ns)
      : writer_(*writer), grid_step_ns_(grid_step_ns) {}

  void Begin(const playback::Player* player) override;
  void Until(uint64_t until_ns) override;
  void Note(const capture::Record& /*record*/) override {}
  /// At the end of a recording everything is shown, whatever is due.
  void End(uint64_t end_ns) override { At(end_ns, true); }
  bool has_failed() const override { return !status_.ok(); }
  const Status& status() const { return status_; }

 protected:
  struct Moment {
    uint64_t time_ns = 0;
    const control::FieldView& view;
    const std::vector<control::ClientView>& clients;
    bool is_new = false;   ///< the configuration is another one than before
    bool is_slow = false;  ///< what seldom changes is due, too
  };

  /// Another recording: what was before is forgotten.
  virtual void Forget() {}
  virtual void Show(const Moment& moment) = 0;
  /// A pheromone whose raster has changed.
  virtual void ShowGrid(const field::PheromoneLaw& law, const web::PheromoneRaster& raster,
                        uint64_t time_ns) = 0;
  /// The channel of a topic, when it is first written to.
  virtual mcap::Channel ChannelOf(const std::string& topic, std::string_view schema) const = 0;

  void Write(const std::string& topic, std::string_view schema, uint64_t time_ns,
             std::string_view message);
  const playback::Player& player() const { return *player_; }

 private:
  void At(uint64_t time_ns, bool is_end);
  void Grids(const control::FieldView& view, uint64_t time_ns);

  mcap::Writer& writer_;
  const uint64_t grid_step_ns_;
  const playback::Player* player_ = nullptr;
  std::map<std::string, uint16_t> channels_;
  std::map<uint8_t, std::unique_ptr<web::PheromoneRaster>> rasters_;
  std::optional<engine::SharedConfig> config_;
  uint64_t origin_ns_ = 0;
  uint64_t next_ns_ = 0;
  Status status_ = Ok();
};

}  // namespace pheromone::ctl
