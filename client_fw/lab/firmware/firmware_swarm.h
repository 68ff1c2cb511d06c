// The robots of a world as firmware: each runs Robot<> of client_fw/core, and its messages are
// handled by the engine's service, as the daemon's are, or by a daemon. Of the radio there is only
// when: a request is handled in the step in which it is sent and answered in the next one, or, with
// a RadioModel, when measured rounds would have done that.
//
//   auto swarm = FirmwareSwarm::Create({.engine = engine, .robots = parameters, .radio = model});
//   group.behaviour = swarm.value();      // of all groups of the world: its robots in their order
//
// With a RadioModel a robot is given a turn by a ROUND and answered by the next one: at those
// milliseconds its loop turns besides once in each step. A ROUND is its own alone, and at least one
// comes every second. HELLO, and what it sends outside of turns, is answered in the next step.
//
// The world's own field is not used: its field() is the engine's, which the robots sense and lay
// trails on. With another server there is none in this process.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "client_fw/lab/behaviour.h"
#include "client_fw/lab/firmware/firmware_robot.h"
#include "client_fw/lab/firmware/server.h"
#include "client_fw/lab/link/rounds_link.h"
#include "server/base/result.h"
#include "server/core/engine/event.h"

namespace pheromone::lab {

struct FirmwareConfig {
  engine::EngineConfig engine;             ///< without links; they are made
  std::vector<client::Parameters> robots;  ///< IDs, starts and what is of the link are set
  std::optional<RadioModel> radio;         ///< for the engine in this process
  uint64_t seed = 1;
  /// None: the engine in this process. Another one is in real time: robots are switched on one
  /// after the other within a second, so that they do not ask all at once, and take answers to be
  /// late.
  std::shared_ptr<Server> server;
};

class FirmwareSwarm final : public Behaviour {
 public:
  /// Errors: the engine does not accept the configuration.
  static Result<std::shared_ptr<FirmwareSwarm>> Create(FirmwareConfig config);

  Status Act(const PheromoneView& view, const PheromoneActions& actions, size_t first,
             size_t count) override;
  Result<StepOutcome> EndStep(uint64_t now_ms) override;
  const field::Field* field() const override { return config_.server->field(); }
  uint64_t Hash() const override;

  const FirmwareRobot& robot(size_t index) const { return lives_[index].robot; }
  Server& server() { return *config_.server; }

 private:
  enum class Mail : uint8_t { kNone, kAsked, kSent, kAnswered };
  struct Life {
    explicit Life(const client::Parameters& parameters) : robot(parameters) {}

    FirmwareRobot robot;
    LinkExchange next;
    int64_t clock_ms = 0;
    int64_t start_ms = 0;
    int64_t round_ms = 0;   // of the last ROUND
    int64_t heard_ms = -1;  // of the last intensities; -1: none
    uint8_t number = 0;     // of the last ROUND
    bool in_turn = false;   // what was sent last
  };

  FirmwareSwarm(FirmwareConfig config);
  void Live(size_t i, int64_t now_ms);
  /// What a message from or to the robot says, without what signing has added.
  protocol::Message Unsigned(size_t i, const protocol::Message& message) const;
  void TakeTurn(size_t i);
  void Answer(size_t i, int64_t at_ms);
  void HearRound(Life* life, int64_t at_ms, bool grant,
                 const std::optional<protocol::RoundAnswer>& answer);
  void Turn(size_t i, int64_t at_ms);

  FirmwareConfig config_;
  std::optional<RoundsLink> link_;
  std::deque<Life> lives_;
  // What is on its way, an element a robot, apart from the robots since all are looked through.
  std::vector<Mail> mail_;
  std::vector<protocol::Message> messages_;
  std::atomic<uint64_t> answers_ = 0;  // in this step
  std::atomic<uint64_t> stops_ = 0;
  std::vector<RobotMessage> sent_;  // in this step
  std::vector<RobotMessage> received_;
};

}  // namespace pheromone::lab
