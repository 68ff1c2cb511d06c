#include "proto_tests/component_demo/visits.h"

#include <algorithm>
#include <string>

#include "server/base/hash.h"
#include "server/config/reader.h"

namespace pheromone::visits {
namespace {

Result<Settings> SettingsIn(const engine::EngineConfig& config) {
  const engine::ComponentConfig* const its = config.FindComponent(kSection.key);
  return its != nullptr ? engine::FromBytes<Settings>("visits", its->version, its->bytes)
                        : Result<Settings>(Settings{});
}

Result<Reset> ResetIn(const engine::Event& event) {
  const auto& it = std::get<engine::ComponentEvent>(event);
  return engine::FromBytes<Reset>("a reset of visits", it.version, it.bytes);
}

}  // namespace

std::optional<engine::ComponentConfig> ReadSection(const config::Value& root,
                                                   const config::Config& /*config*/,
                                                   config::Notes* notes) {
  const config::TableReader table(config::TableOf(root, kSection.key, notes),
                                  std::string(kSection.key), &notes->problems);
  table.AllowOnly({"forget_after_s"});
  const auto forget_after_ms =
      table.Scaled("forget_after_s", config::kSecondsToMs, 1, 86'400'000, 60'000);
  if (!forget_after_ms) {
    return std::nullopt;
  }
  ByteWriter writer;
  EncodeFields(Settings{static_cast<uint64_t>(*forget_after_ms)}, &writer);
  return engine::ComponentConfig{std::string(kSection.key), Settings::kVersion, writer.Take()};
}

std::optional<uint16_t> Visits::CountOf(uint8_t station) const {
  const auto found = stations_.find(station);
  return found != stations_.end() ? std::optional(found->second.count) : std::nullopt;
}

std::vector<engine::MessageRule> Visits::messages() const {
  return {{kVisit, {true, 2, 2}, engine::MessageRule::Effect::kChanges}};
}

Status Visits::CheckConfig(const engine::Context& /*context*/, const engine::EngineConfig& next,
                           const engine::ConfigPlan* /*plan*/) const {
  const Result<Settings> settings = SettingsIn(next);
  return settings.ok() ? Ok() : Error{settings.error()};
}

void Visits::Configure(const engine::Context& context, const engine::Reconfiguration& /*change*/,
                       const engine::Output& /*out*/) {
  settings_ = SettingsIn(*context.config).value();
}

protocol::Message Visits::Change(const engine::Context& context, engine::LinkIndex /*link*/,
                                 const protocol::Message& request) {
  Station& station = stations_[request.data[1]];
  station.count = static_cast<uint16_t>(std::min(station.count + 1, 0xFFFF));
  station.forget_ms = context.now_ms + settings_.forget_after_ms;
  protocol::Message answer;
  answer.id = request.id;
  answer.opcode = kVisitAnswer;
  answer.length = 3;
  answer.data[0] = request.data[0];
  answer.data[1] = static_cast<uint8_t>(station.count);
  answer.data[2] = static_cast<uint8_t>(station.count >> 8);
  return answer;
}

Status Visits::Check(const engine::Context& /*context*/, const engine::Event& event) const {
  const Result<Reset> reset = ResetIn(event);
  if (!reset.ok()) {
    return Error{reset.error()};
  }
  return CountOf(reset.value().station)
             ? Ok()
             : Error{"station " + std::to_string(reset.value().station) + " has no visits"};
}

void Visits::Apply(const engine::Context& /*context*/, const engine::Event& event,
                   const engine::Output& /*out*/) {
  stations_.erase(ResetIn(event).value().station);
}

void Visits::Advance(const engine::Context& context, const engine::Output& /*out*/) {
  std::erase_if(stations_, [&](const auto& it) { return it.second.forget_ms <= context.now_ms; });
}

std::optional<uint64_t> Visits::NextDeadline() const {
  const auto next = std::min_element(
      stations_.begin(), stations_.end(),
      [](const auto& a, const auto& b) { return a.second.forget_ms < b.second.forget_ms; });
  return next != stations_.end() ? std::optional(next->second.forget_ms) : std::nullopt;
}

uint64_t Visits::Hash() const {
  uint64_t hash = 0;
  for (const auto& [number, station] : stations_) {
    hash += Hash64({'V', number, station.count, station.forget_ms});
  }
  return hash;
}

void Visits::Save(ByteWriter* writer) const {
  writer->Count(stations_.size());
  for (const auto& [number, station] : stations_) {
    writer->U8(number);
    writer->U16(station.count);
    writer->U64(station.forget_ms);
  }
}

void Visits::Restore(const engine::Context& context, uint8_t /*version*/, ByteReader* reader) {
  settings_ = SettingsIn(*context.config).value();
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    const uint8_t number = reader->U8();
    if (!stations_.empty() && number <= stations_.rbegin()->first) {
      reader->Fail("stations out of order");
    }
    stations_[number] = {reader->U16(), reader->U64()};
  }
}

}  // namespace pheromone::visits
