// A control interface whose answers the test decides, and which remembers what it was asked to
// change. The field is a real one: 4 m x 3 m, cells of 0.5 m, type 1 "trail", type 2 "path" and a
// blend, 3 "guide"; a wall blocks node (0, 0).
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/operators/control/control.h"
#include "server/operators/web/api/api.h"

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

class FakeControl final : public control::Control {
 public:
  explicit FakeControl(const field::FieldConfig& initial = SmallField())
      : config(initial), field(initial) {}

  control::StatusView GetStatus(bool with_hash) const override {
    control::StatusView view = status;
    if (with_hash) {
      view.state_hash = 0x0123456789abcdef;
    }
    return view;
  }
  std::vector<control::LinkView> GetLinks() const override { return links; }
  std::vector<control::TrackerView> GetTrackers() const override { return trackers; }
  std::vector<control::ClientView> GetClients() const override { return clients; }
  control::FieldView GetField() const override { return {&field, config, now_ms}; }
  std::vector<field::Path> GetPaths() const override { return config.paths; }
  control::CaptureView GetCapture() const override { return status.capture; }
  control::TagPage GetTags(uint16_t first) const override {
    control::TagPage page;
    for (const control::TagView& tag : tags) {
      if (tag.content.number >= first) {
        page.tags.push_back(tag);
      }
    }
    return page;
  }
  std::optional<uint16_t> FindTag(std::string_view name) const override {
    for (const control::TagView& tag : tags) {
      if (tag.content.name == name) {
        return tag.content.number;
      }
    }
    return std::nullopt;
  }
  control::SymbolPage GetSymbols(size_t first) const override {
    const size_t begin = std::min(first, rows.size());
    return {{rows.begin() + static_cast<ptrdiff_t>(begin), rows.end()},
            std::vector<tags::Maker>(rows.size() - begin, tags::Maker{"radio", 7}),
            rows.size()};
  }
  std::vector<control::NetView> GetNets() const override { return nets; }
  control::ConfigView GetConfig() const override {
    return {.lines = {"a \"map\"", "two\nlines"}, .file = "/lab.toml", .journal = {}};
  }
  Status CheckHealth() const override { return outcome; }

  std::unique_ptr<control::Subscription> Subscribe(control::ListenerOptions options) override {
    return board.Subscribe(std::move(options));
  }
  void Announce(const control::Notice& notice) override { board.Publish(notice); }

  void Edit(const field::FieldEdit& edit, DoneWith<control::EditOutcome> done) override {
    const auto nodes = field::NodesOf(edit, SmallField().map);
    if (!outcome.ok() || !nodes.ok() || nodes.value().empty()) {
      done(Error{outcome.ErrorOr(nodes.ErrorOr("the shape contains no node of the map"))});
      return;
    }
    edits.push_back(edit);
    done(control::EditOutcome{nodes.value().size(), nodes.value().size() - 1, 40 + edits.size()});
  }
  void Reverse(bool redo, DoneWith<control::ReverseOutcome> done) override {
    control::ReverseOutcome reversed{
        {.id = 41, .utc_ms = 1'700'000'000'500, .type = 1}, "path", redo ? uint64_t{85} : 84};
    reversed.edit.shape = field::FieldEdit::Shape::kStroke;
    done(Or(reversed));
  }
  void Issue(std::string_view link, uint8_t id, protocol::CommandCode code,
             std::span<const uint8_t> arguments, Done done) override {
    commands.push_back({std::string(link), id, code, {arguments.begin(), arguments.end()}});
    done(outcome);
  }
  void SetGoal(std::string_view link, uint8_t id, field::PointUm point, uint32_t tolerance_um,
               Done done) override {
    goals.push_back({std::string(link), id, point, tolerance_um});
    done(outcome);
  }
  void CancelGoal(std::string_view link, uint8_t id, Done done) override {
    goals.push_back({std::string(link), id, {}, 0});
    done(outcome);
  }
  void ChangeTags(const engine::TagsChanged& change, Done done) override {
    tag_changes.push_back(change);
    done(outcome);
  }
  void ChangeNets(const engine::NetsChanged& change, Done done) override {
    net_changes.push_back(change);
    done(outcome);
  }
  void RevokeKeys(std::span<const uint8_t> robots,
                  DoneWith<std::vector<std::string>> done) override {
    revoked.assign(robots.begin(), robots.end());
    done(Or(std::vector<std::string>{"radio-a", "radio-b"}));
  }
  void HaltAll(DoneWith<std::vector<std::string>> done) override {
    done(Or(std::vector<std::string>{"radio-a", "radio-b"}));
  }
  void ChangeTau(uint8_t type, int64_t tau_ms, Done done) override {
    changed_tau = {type, tau_ms};
    done(outcome);
  }
  void Reload(DoneWith<std::vector<std::string>> done) override {
    done(Or(std::vector<std::string>{"links wait"}));
  }
  void Snapshot(DoneWith<std::optional<std::string>> done) override { done(Or(snapshot)); }
  void StartCapture(Done done) override { Capture(true, done); }
  void StopCapture(Done done) override { Capture(false, done); }

  std::pair<uint8_t, int64_t> changed_tau{};

  struct Command {
    std::string link;
    uint8_t id = 0;
    protocol::CommandCode code = protocol::CommandCode::kHalt;
    std::vector<uint8_t> arguments;
    bool operator==(const Command&) const = default;
  };

  /// Without tolerance: cancelled.
  struct Goal {
    std::string link;
    uint8_t id = 0;
    field::PointUm point;
    uint32_t tolerance_um = 0;
    bool operator==(const Goal&) const = default;
  };

  Status outcome = Ok();  ///< of all that can fail
  std::optional<std::string> snapshot = "snapshot-7";
  control::StatusView status;
  std::vector<control::LinkView> links;
  std::vector<control::TrackerView> trackers;
  std::vector<control::ClientView> clients;
  field::FieldConfig config;
  field::Field field;
  uint64_t now_ms = 1000;
  control::NoticeBoard board;
  std::vector<field::FieldEdit> edits;
  std::vector<Command> commands;
  std::vector<Goal> goals;
  std::vector<control::TagView> tags;
  std::vector<pheromone::tags::Row> rows;
  std::vector<engine::TagsChanged> tag_changes;
  std::vector<control::NetView> nets;
  std::vector<engine::NetsChanged> net_changes;
  std::vector<uint8_t> revoked;

 private:
  void Capture(bool recording, const Done& done) {
    status.capture.recording = outcome.ok() ? recording : status.capture.recording;
    done(outcome);
  }

  template <typename T>
  Result<T> Or(T value) const {
    return outcome.ok() ? Result<T>(std::move(value)) : outcome.error();
  }
};

/// What the API answers, which it does before Handle returns where there are no lanes.
inline Response AnswerOf(Api* api, Request request) {
  std::optional<Response> answer;
  api->Handle(std::move(request), [&](Response response) {
    EXPECT_FALSE(answer.has_value()) << "answered twice";
    answer = std::move(response);
  });
  EXPECT_TRUE(answer.has_value()) << "not answered";
  return answer.value_or(Response{.status = 0});
}

}  // namespace pheromone::web::testing
