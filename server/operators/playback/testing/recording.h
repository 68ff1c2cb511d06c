// A recording of random traffic for tests, with what a live server showed meanwhile.
//
//   const Recording recording = Recording::Make(42, 20'000);
//   Player player = recording.MakePlayer();
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/base/testing/temporary_folder.h"
#include "server/core/engine/testing/random_traffic.h"
#include "server/operators/control/engine_views.h"
#include "server/operators/playback/player.h"
#include "server/store/capture/testing/live.h"

namespace pheromone::playback::testing {

/// What the live server was like at the end of a millisecond.
struct Moment {
  uint64_t hash = 0;
  uint64_t field_ms = 0;
  std::vector<int64_t> levels;  ///< of type 1, as they were sensed at some places
  std::vector<std::pair<uint8_t, uint64_t>> requests;  ///< of each robot of link 0
  std::vector<std::string> states;                     ///< and what it is doing, and why
};

inline std::string StateText(const control::ClientView& client) {
  return std::string(control::NameOf(client.condition.state)) + ": " + client.condition.reason;
}

inline Moment MomentOf(const engine::Engine& engine, const engine::Traffic& traffic,
                       uint64_t field_ms) {
  Moment moment{
      .hash = engine.StateHash(), .field_ms = field_ms, .levels = {}, .requests = {}, .states = {}};
  const field::FieldReader reader(engine.field());
  for (int i = 0; i < 25; ++i) {
    const field::PoseUm pose{{i % 5 * 900'000, i / 5 * 900'000}, 0};
    const auto sensed = reader.Sense(1, pose, field_ms);
    moment.levels.push_back(sensed ? int64_t{sensed->left} + sensed->right : -1);
  }
  for (const control::ClientView& client : control::ClientsOf(engine, traffic, field_ms)) {
    moment.requests.emplace_back(client.id, client.traffic.requests);
    moment.states.push_back(StateText(client));
  }
  return moment;
}

class Recording {
 public:
  /// `length_ms` long.
  Recording(uint64_t seed, uint64_t length_ms) {
    using capture::testing::FrameOf;
    using capture::testing::Live;
    engine::testing::RandomTraffic traffic(seed);
    const engine::Event first = traffic.First();
    Live live(folder_ / "captures", *std::get<engine::ConfigChanged>(first).config,
              traffic.stamp().field_time_ms);
    EXPECT_TRUE(live.Record().ok());
    const uint64_t end_ms = live.now_ms + length_ms;
    while (live.now_ms < end_ms) {
      const engine::Event event =
          live.service().Inspect([&](const auto& engine) { return traffic.Next(engine); });
      live.now_ms = std::max(live.now_ms.load(), traffic.stamp().field_time_ms);
      std::vector<engine::Outgoing> out;
      if (const auto* request = std::get_if<engine::RequestReceived>(&event)) {
        live.Hear(request->link, FrameOf(request->message));
      } else if (const auto* command = std::get_if<engine::CommandIssued>(&event)) {
        static_cast<void>(live.service().Issue(*command, &out));
      } else if (const auto* edited = std::get_if<engine::FieldEdited>(&event)) {
        static_cast<void>(live.service().Edit(edited->edit));
      } else if (const auto* reversed = std::get_if<engine::EditReversed>(&event)) {
        static_cast<void>(live.service().Reverse(reversed->redo));
      } else if (const auto* change = std::get_if<engine::ConfigChanged>(&event)) {
        static_cast<void>(live.service().Configure(change->config, change->new_epoch));
      }
      live.Deliver(out);
      live.Advance();
      live.Hear(0, FrameOf(traffic.AnySense()));
      live.service().InspectTraffic(
          [&](const engine::Engine& engine, const engine::Traffic& counts) {
            moments[(Live::kUtcMs + live.now_ms) * 1'000'000] =
                MomentOf(engine, counts, std::max(live.now_ms.load(), engine.field_time_ms()));
          });
    }
    live.Finish();
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "captures")) {
      path = entry.path();
    }
  }

  Player MakePlayer(PlayerOptions options = {}) const {
    Player player(
        path, [path = path](uint64_t from) { return capture::OpenFile(path, from); },
        std::move(options));
    while (!player.Survey(1000)) {
    }
    return player;
  }

  std::string path;
  std::map<uint64_t, Moment> moments;  ///< by UTC in ns

 private:
  const TemporaryFolder folder_;
};

}  // namespace pheromone::playback::testing
