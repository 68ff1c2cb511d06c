#include "client_fw/lab/firmware/engine_server.h"

#include <fmt/format.h>

#include <utility>

#include "client_fw/lab/firmware/channel.h"

namespace pheromone::lab {
namespace {

constexpr uint16_t kEpoch = 1;

}  // namespace

EngineServer::EngineServer()
    : service_(&log_, [this] {
        return engine::ClockReading{static_cast<uint64_t>(now_ms_), now_ms_};
      }) {}

Result<std::unique_ptr<EngineServer>> EngineServer::Create(engine::EngineConfig config,
                                                           size_t robots) {
  for (size_t first = 0; first < robots; first += kMaxRobotsOfLink) {
    config.links.push_back(
        {fmt::format("radio-{}", first / kMaxRobotsOfLink + 1), kSlotMs, kWindowMs});
  }
  std::unique_ptr<EngineServer> server(new EngineServer);
  PHEROMONE_TRY(const auto configured, server->service_.Configure(config, kEpoch));
  (void)configured;
  return server;
}

Status EngineServer::Exchange(int64_t now_ms, std::span<const RobotMessage> sent,
                              std::vector<RobotMessage>* received) {
  now_ms_ = now_ms;
  out_.clear();
  service_.AdvanceIfDue(&out_);
  for (size_t i = 0; i < sent.size();) {
    const size_t link = sent[i].robot / kMaxRobotsOfLink;
    batch_.clear();
    for (; i < sent.size() && sent[i].robot / kMaxRobotsOfLink == link; ++i) {
      batch_.push_back(sent[i].message);
    }
    service_.Handle(static_cast<engine::LinkIndex>(link), batch_, &out_);
  }
  for (const engine::Outgoing& outgoing : out_) {
    received->push_back(
        {outgoing.link * kMaxRobotsOfLink + outgoing.message.id - 1u, outgoing.message});
  }
  return Ok();
}

}  // namespace pheromone::lab
