// The engine's service in this process: a message is handled as the daemon would, at once.
//
//   Result<std::unique_ptr<EngineServer>> server = EngineServer::Create(config, /*robots=*/1000);
//   server.value()->Exchange(now_ms, sent, &received);
//
// One thread.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "client_fw/lab/firmware/server.h"
#include "server/base/result.h"
#include "server/core/engine/service/ordered_log.h"
#include "server/core/engine/service/service.h"

namespace pheromone::lab {

class EngineServer final : public Server {
 public:
  /// `config` is without links; as many are made as the robots need. Errors: the engine does not
  /// accept it.
  static Result<std::unique_ptr<EngineServer>> Create(engine::EngineConfig config, size_t robots);

  size_t robots_of_link() const override { return kMaxRobotsOfLink; }
  Status Exchange(int64_t now_ms, std::span<const RobotMessage> sent,
                  std::vector<RobotMessage>* received) override;
  const field::Field* field() const override {
    return service_.Inspect([](const engine::Engine& engine) { return &engine.field(); });
  }
  uint64_t Hash() const override { return service_.StateHash(); }

  engine::Service& service() { return service_; }

 private:
  EngineServer();

  int64_t now_ms_ = 0;
  engine::VolatileLog log_;
  engine::Service service_;
  std::vector<protocol::Message> batch_;
  std::vector<engine::Outgoing> out_;
};

}  // namespace pheromone::lab
