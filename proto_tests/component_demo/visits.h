// A component that shows what one needs: it counts how often robots visited a station.
//
//   robot:     VISIT (0x4F): seq, station       ->  0xCF: seq, visits u16
//   operator:  Reset{station}
//   file:      [visits] forget_after_s = 60
//
// Everything about it is in this folder.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "protocol/messages.h"
#include "server/config/sections.h"
#include "server/engine/component.h"

namespace pheromone::visits {

constexpr uint8_t kVisit = 0x4F;
constexpr uint8_t kVisitAnswer = 0xCF;

/// The key of the configuration.
struct Settings {
  static constexpr uint8_t kVersion = 1;
  uint64_t forget_after_ms = 60'000;  ///< since a station's last visit

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("forget_after_ms", it.forget_after_ms, Within(1, 86'400'000));
  }
};
std::optional<engine::ComponentConfig> ReadSection(const config::Value& root,
                                                   const config::Config& config,
                                                   config::Notes* notes);
constexpr config::ComponentSection kSection{"visits", ReadSection};

/// The event.
struct Reset {
  static constexpr engine::EventKind kKind{200};
  static constexpr uint8_t kVersion = 1;
  uint8_t station = 0;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("station", it.station);
  }
};

class Visits final : public engine::Component {
 public:
  std::optional<uint16_t> CountOf(uint8_t station) const;

  std::unique_ptr<Component> Clone() const override { return std::make_unique<Visits>(*this); }
  std::string_view name() const override { return kSection.key; }
  uint8_t version() const override { return 1; }
  std::vector<engine::MessageRule> messages() const override;
  std::vector<engine::EventKind> event_kinds() const override { return {Reset::kKind}; }
  Status CheckConfig(const engine::Context& context, const engine::EngineConfig& next,
                     const engine::ConfigPlan* plan) const override;
  void Configure(const engine::Context& context, const engine::Reconfiguration& change,
                 const engine::Output& out) override;
  protocol::Message Change(const engine::Context& context, engine::LinkIndex link,
                           const protocol::Message& request) override;
  Status Check(const engine::Context& context, const engine::Event& event) const override;
  void Apply(const engine::Context& context, const engine::Event& event,
             const engine::Output& out) override;
  void Advance(const engine::Context& context, const engine::Output& out) override;
  std::optional<uint64_t> NextDeadline() const override;
  uint64_t Hash() const override;
  void Save(ByteWriter* writer) const override;
  void Restore(const engine::Context& context, uint8_t version, ByteReader* reader) override;

 private:
  struct Station {
    uint16_t count = 0;
    uint64_t forget_ms = 0;  // field time
  };
  std::map<uint8_t, Station> stations_;
  Settings settings_;
};

}  // namespace pheromone::visits
