// A control interface whose answers the test decides, and which remembers what it was asked to
// change. The field is a real one: 4 m x 3 m, cells of 0.5 m, type 1 "trail", type 2 "path" and a
// blend, 3 "guide"; a wall blocks node (0, 0).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/engine/control.h"

namespace pheromone::web::testing {

inline field::FieldConfig SmallField() {
  field::FieldConfig config;
  config.map = {
      .origin = {0, 0}, .width_um = 4'000'000, .height_um = 3'000'000, .cell_um = 500'000};
  config.antennas.distance_um = 1'000'000;
  field::PheromoneLaw law;
  law.type = 1;
  law.name = "trail";
  law.core_um = 500'000;
  law.sigma_um = 500'000;
  law.tau_ms = 30'000;
  law.quantum_micro = 250'000;
  law.max_count = 8;
  config.pheromones.push_back(law);
  law.type = 2;
  law.name = "path";
  law.tau_ms = 0;
  config.pheromones.push_back(law);
  field::PheromoneLaw guide;
  guide.type = 3;
  guide.name = "guide";
  guide.blend = {{1, 1000}, {2, 500}};
  config.pheromones.push_back(guide);
  field::ObstacleMask wall(config.map.columns(), config.map.rows());
  wall.BlockRow(0, 0, 0);
  config.obstacles = field::Shared<field::ObstacleMask>(std::move(wall));
  config.memory_bytes = 16 << 20;
  return config;
}

class FakeControl final : public engine::Control {
 public:
  explicit FakeControl(const field::FieldConfig& config = SmallField()) : field(config) {}

  engine::StatusView GetStatus(bool with_hash) const override {
    engine::StatusView view = status;
    if (with_hash) {
      view.state_hash = 0x0123456789abcdef;
    }
    return view;
  }
  std::vector<engine::LinkView> GetLinks() const override { return links; }
  std::vector<engine::ClientView> GetClients() const override { return clients; }
  engine::FieldView GetField() const override { return {&field, field.config(), now_ms}; }
  engine::CaptureView GetCapture() const override { return status.capture; }
  std::vector<std::string> GetConfig() const override { return {"a \"map\"", "two\nlines"}; }
  Status CheckHealth() const override { return outcome; }

  Status Edit(const field::FieldEdit& edit) override {
    edits.push_back(edit);
    return outcome;
  }
  Status Issue(std::string_view link, uint8_t id, protocol::CommandCode code,
               std::span<const uint8_t> arguments) override {
    commands.push_back({std::string(link), id, code, {arguments.begin(), arguments.end()}});
    return outcome;
  }
  Result<std::vector<std::string>> HaltAll() override { return List({"radio-a", "radio-b"}); }
  Result<std::vector<std::string>> Reload() override { return List({"links wait"}); }
  Result<std::string> Snapshot() override {
    return outcome.ok() ? Result<std::string>(std::string("snapshot-7")) : Error{outcome.error()};
  }
  Status StartCapture() override { return Capture(true); }
  Status StopCapture() override { return Capture(false); }

  struct Command {
    std::string link;
    uint8_t id = 0;
    protocol::CommandCode code = protocol::CommandCode::kHalt;
    std::vector<uint8_t> arguments;
    bool operator==(const Command&) const = default;
  };

  Status outcome = Ok();  ///< of all that can fail
  engine::StatusView status;
  std::vector<engine::LinkView> links;
  std::vector<engine::ClientView> clients;
  field::Field field;
  uint64_t now_ms = 1000;
  std::vector<field::FieldEdit> edits;
  std::vector<Command> commands;

 private:
  Status Capture(bool recording) {
    status.capture.recording = outcome.ok() ? recording : status.capture.recording;
    return outcome;
  }

  Result<std::vector<std::string>> List(std::vector<std::string> list) const {
    return outcome.ok() ? Result<std::vector<std::string>>(std::move(list))
                        : Error{outcome.error()};
  }
};

}  // namespace pheromone::web::testing
