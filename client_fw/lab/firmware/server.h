// The server of robots as firmware: takes the messages of a step and gives what is sent to robots.
// EngineServer is in this process (engine_server.h); client_fw/swarm has that of a daemon.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/messages.h"
#include "server/base/result.h"
#include "server/core/field/field.h"

namespace pheromone::lab {

/// Robots to a link: IDs 1 to 254.
constexpr size_t kMaxRobotsOfLink = 254;

struct RobotMessage {
  size_t robot = 0;  ///< its number in the world
  protocol::Message message;
};

/// With what a robot signs its frames.
struct RobotSigning {
  const uint8_t* key = nullptr;  ///< 16 bytes, that outlive the robot; null: it does not sign
  uint16_t start = 0;            ///< its nonce, which nobody has used with this key
};

class Server {
 public:
  Server() = default;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  virtual ~Server() = default;

  /// Robots have consecutive links and IDs: so many to a link, 1 to kMaxRobotsOfLink.
  virtual size_t robots_of_link() const = 0;
  virtual RobotSigning signing(size_t /*robot*/) const { return {}; }
  /// Takes what robots sent in the step that ends now, in the order of their numbers, and appends
  /// what was sent to robots. An error ends the run.
  virtual Status Exchange(int64_t now_ms, std::span<const RobotMessage> sent,
                          std::vector<RobotMessage>* received) = 0;
  /// Null: it is not in this process.
  virtual const field::Field* field() const { return nullptr; }
  /// Of its state, to tell two runs apart.
  virtual uint64_t Hash() const { return 0; }
};

}  // namespace pheromone::lab
