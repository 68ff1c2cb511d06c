// Random events for tests of properties of every state: robots that connect, deposit, trace,
// restart and repeat requests; an operator's edits, their undoing, and commands; a tracker; passing
// time; changed configurations. Everything can also happen live: an event that the engine would
// refuse is drawn again.
//
//   RandomTraffic traffic(seed);
//   engine.Apply(1, traffic.stamp(), traffic.First(), &out);
//   const Event event = traffic.Next(engine);
//   engine.Apply(2, traffic.stamp(), event, &out);
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "server/core/engine/engine.h"
#include "server/core/engine/testing/bench.h"
#include "server/core/engine/testing/random_tags.h"
#include "server/core/field/cell_map.h"

namespace pheromone::engine::testing {

/// Every kind of law, a blend, obstacles, a path, an initial raster, a frame, tags, a net; 6 m x 6
/// m, nine leaves and a few hundred tiles. `tight`: memory for only a few of the tiles.
inline EngineConfig RichConfig(bool tight) {
  EngineConfig config = SmallConfig();
  field::FieldConfig& field = config.field;
  field.map = {
      .origin = {-1'000'000, 0}, .width_um = 6'000'000, .height_um = 6'000'000, .cell_um = 20'000};
  field.antennas.distance_um = 60'000;
  field.pheromones = {Law(1, 3'000), Law(2, 0), Law(3, 4'000), Law(5, 2'000), Law(6, 5'000)};
  for (field::PheromoneLaw& law : field.pheromones) {
    law.core_um = 20'000;
    law.sigma_um = 80'000;
  }
  field.pheromones[2].evaporation = field::Evaporation::kExponential;
  field.pheromones[2].diffusion = {8'000, 100, 0xFF00'0000, 512};
  field.pheromones[3].evaporation = field::Evaporation::kExponential;
  field.pheromones[4].evaporation = field::Evaporation::kLinear;
  field::PheromoneLaw blend;
  blend.type = 4;
  blend.name = "blend";
  blend.blend = {{1, 700}, {3, -400}};
  field.pheromones.push_back(blend);
  field.paths = {{2, 1, true, {{0, 1'000'000}, {400'000, 1'000'000}, {400'000, 1'200'000}}}};
  field.initial_rasters = {
      {1, field::Shared(std::vector<field::InitialNode>{{{3, 4}, 64}, {{200, 9}, 128}})}};
  field::ObstacleMask walls(field.map.columns(), field.map.rows());
  walls.BlockRow(60, 20, 90);
  walls.Set({301 - 1, 301 - 1});
  field.obstacles = field::Shared(std::move(walls));
  config.frames = {MakeFrame("radio-b", 2, {1'000'000, 0}, 30)};
  config.tags = RichTags();
  config.nets = RichNets();
  if (tight) {
    using field::CellMap;
    field.memory_bytes = 24 * CellMap::kTileBytes + 8 * CellMap::kLeafBytes +
                         5 * CellMap::TopBytes(field.map.columns(), field.map.rows());
  }
  return config;
}

class RandomTraffic {
 public:
  explicit RandomTraffic(uint64_t seed, const EngineConfig& config = RichConfig(false))
      : random_(seed), config_(config) {
    stamp_ = {Below(100'000), static_cast<int64_t>(Below(1'000'000))};
  }

  const Stamp& stamp() const { return stamp_; }
  /// Continues from there, as after a restart.
  void ResumeAt(const Stamp& stamp) { stamp_ = stamp; }
  Event First() const { return ConfigChanged{config_, 7}; }

  /// Time passes, and the next event is one that `engine` accepts.
  Event Next(const Engine& engine) {
    stamp_.field_time_ms += Below(20) == 0 ? Below(8'000) : Below(60);
    stamp_.utc_ms += static_cast<int64_t>(Below(200)) - 20;
    for (;;) {
      Event event = Any(engine);
      if (engine.Check(event).ok()) {
        return event;
      }
    }
  }

  /// A request that changes nothing, with a robot's position.
  protocol::Message AnySense() {
    return Sense(AnyId(), AnyPlace(), AnyPlace(), static_cast<uint16_t>(Below(65'536)),
                 static_cast<uint8_t>(1 + Below(7)));
  }

  uint64_t Below(uint64_t limit) { return random_() % limit; }

 private:
  uint8_t AnyId() { return static_cast<uint8_t>(1 + Below(6)); }
  // In millimetres; mostly within a square of 80 cm, where trails meet, sometimes off the map.
  int16_t AnyPlace() {
    return static_cast<int16_t>(Below(6) == 0 ? Below(6'400) - 200 : 300 + Below(800));
  }
  field::PointUm AnyPoint() { return {AnyPlace() * int64_t{1'000}, AnyPlace() * int64_t{1'000}}; }

  // Its next seq, and sometimes another one.
  uint8_t SeqOf(const Engine& engine, LinkIndex link, uint8_t id) {
    const RobotState* robot = engine.robots().Find(link, id);
    const auto ahead = static_cast<uint8_t>(Below(8) == 0 ? Below(200) : 1);
    return static_cast<uint8_t>((robot != nullptr ? robot->last_seq : 0) + ahead);
  }

  // Of few, so that some are revoked again.
  RevokedKey AnyKey() { return {AnyId(), {static_cast<uint8_t>(Below(4)), 0xFF}}; }

  Event Request(const Engine& engine) {
    const auto link = static_cast<LinkIndex>(Below(2));
    const uint8_t id = AnyId();
    const uint8_t seq = SeqOf(engine, link, id);
    const auto type = static_cast<uint8_t>(1 + Below(6));
    const RobotState* robot = engine.robots().Find(link, id);
    switch (Below(20)) {
      case 0:
        return RequestReceived{link, Hello(id, static_cast<uint16_t>(Below(3)))};
      case 1:
        return RequestReceived{link, MessageOf(protocol::EventReport{
                                         id, seq, static_cast<protocol::EventCode>(Below(11)), 5})};
      case 2:
        if (robot != nullptr && robot->has_pending_command()) {
          const protocol::Command& command = robot->command.command;
          return RequestReceived{link,
                                 MessageOf(protocol::CommandAck{id, command.seq, command.code,
                                                                static_cast<int16_t>(Below(3))})};
        }
        [[fallthrough]];
      case 3:
      case 4:
      case 5:
      case 6:
      case 7:
        return RequestReceived{link, Trace(id, seq, AnyPlace(), AnyPlace(),
                                           static_cast<uint16_t>(Below(65'536)), type)};
      case 16:
      case 17:
      case 18:
      case 19:
        return RequestReceived{link, tags_.Request(id, seq, AnyPlace(), AnyPlace())};
      default:
        return RequestReceived{
            link, Deposit(id, seq, AnyPlace(), AnyPlace(), static_cast<uint8_t>(Below(4)), type)};
    }
  }

  Event Edit(const Engine& engine) {
    field::FieldEdit edit;
    edit.type = static_cast<uint8_t>(1 + Below(6));
    edit.shape = static_cast<field::FieldEdit::Shape>(Below(20) == 0 ? 2 : Below(2));
    edit.action = static_cast<field::FieldEdit::Action>(Below(3));
    edit.level = static_cast<uint32_t>(Below(513));
    edit.radius_um = static_cast<int64_t>(Below(60'000));
    edit.points = {AnyPoint()};
    edit.points.push_back({edit.points[0].x + static_cast<int64_t>(Below(300'000)),
                           edit.points[0].y + static_cast<int64_t>(Below(100'000))});
    const field::EditHistory::Entry* last = engine.field().history().Next(false);
    edit.continues = last != nullptr && Below(3) == 0 ? last->info.id : 0;
    return FieldEdited{edit};
  }

  Event Reconfigure(const Engine& engine) {
    EngineConfig config = engine.config();
    switch (Below(7)) {
      case 6:
        config.tags = tags_.Settings();
        config.nets = config_.nets.empty() ? config_.nets : tags_.Nets();
        break;
      case 0:
        config.field.pheromones[0].tau_ms = static_cast<int64_t>(1'000 + Below(5'000));
        break;
      case 1:
        config.field.antennas.distance_um += 1'000;  // robots must say hello again
        break;
      case 2:
        config.field.pheromones[4].max_count = static_cast<uint16_t>(4 + Below(9));
        break;
      case 3:  // a link goes, or returns
        config.links.resize(config.links.size() == 2 ? 1 : 2, {"radio-b", 4, 50});
        break;
      case 4: {  // a type stops diffusing, or begins
        field::DiffusionLaw& diffusion = config.field.pheromones[2].diffusion;
        diffusion.exchange_q16 = diffusion.exchange_q16 == 0 ? 8'000 : 0;
        break;
      }
      default:
        if (config.field.paths.empty()) {
          config.field.paths = config_.field.paths;
        } else {
          config.field.paths.clear();
        }
    }
    const auto epoch = static_cast<uint16_t>(8 + Below(9));
    const bool state_lost = Below(4) == 0;
    return ConfigChanged{std::move(config), epoch, state_lost};
  }

  Event Any(const Engine& engine) {
    const auto link = static_cast<LinkIndex>(Below(2));
    switch (Below(26)) {
      case 0:
        return Below(20) == 0  ? Event(NetsChanged{"gate"})
               : Below(3) == 0 ? Event(EditReversed{Below(3) == 0})
                               : Edit(engine);
      case 24:
      case 25:
        return tags_.Change();
      case 1: {
        CommandIssued command{link, AnyId(), static_cast<protocol::CommandCode>(1 + Below(9)), {}};
        command.arguments[0] = static_cast<uint8_t>(Below(256));
        if (Below(3) == 0) {
          command.id = protocol::kBroadcastId;
          command.code = protocol::CommandCode::kHalt;
        }
        return command;
      }
      case 2:
        return PoseObserved{link,
                            AnyId(),
                            {AnyPoint(), static_cast<uint16_t>(Below(65'536))},
                            static_cast<uint32_t>(Below(2'000))};
      case 3:
        return Below(6) == 0 ? Reconfigure(engine) : Event(Advance{});
      case 4:
        if (Below(2) == 0) {
          return GoalSet{link, AnyId(), {{AnyPoint(), AnyPoint()}, 20'000}};
        }
        return GoalEnded{link, AnyId(), Below(2) == 0, AnyPoint()};
      case 5:
        if (Below(16) == 0) {
          return KeysRevoked{{AnyKey(), AnyKey()}};
        }
        return Advance{};
      case 6:
        return Advance{};
      default:
        return Request(engine);
    }
  }

  std::mt19937_64 random_;
  RandomTags tags_{&random_};
  EngineConfig config_;
  Stamp stamp_;
};

}  // namespace pheromone::engine::testing
