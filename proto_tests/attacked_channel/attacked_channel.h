// Robots and a server on one radio channel with rounds, and an attacker without a key among them:
// the daemon's channel and engine, the AVR's image, the firmware compiled for the host. In virtual
// time.
//
//   AttackedChannel channel({.is_signed = true, .seed = 1});
//   channel.Run(5'000); channel.Attack(); channel.Restart(); channel.LosePower();
//
// Robots 1 (the image), 3 (a Pioneer) and 5 (an ideal drive) follow a circle of type 1; 1 and 3
// leave trails on it. Robots 2 (the image) and 4 (an ideal drive) are released too and look for
// type 2, of which there is nothing: they stand, unless somebody forges intensities. The operator
// is on the engine's side. The attacker jams for 3 s of every 8 and sneaks for the rest. One
// thread; deterministic.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <vector>

#include "client_fw/sim/avr/avr_robot.h"
#include "client_fw/sim/mobile_robot.h"
#include "client_fw/sim/radio_medium.h"
#include "client_fw/swarm/server_station.h"
#include "proto_tests/attacked_channel/attacker.h"
#include "proto_tests/attacked_channel/observer.h"
#include "server/core/engine/service/ordered_log.h"
#include "server/core/engine/service/service.h"
#include "server/robots/signing/signing.h"

namespace pheromone::attack {

constexpr int kRobots = 5;
constexpr int64_t kPeriodMs = 8'000;
constexpr int64_t kJammingMs = 3'000;

struct ChannelOptions {
  bool is_signed = true;
  bool is_attacked = true;
  uint64_t seed = 1;
};

class AttackedChannel {
 public:
  explicit AttackedChannel(const ChannelOptions& options);
  AttackedChannel(const AttackedChannel&) = delete;
  AttackedChannel& operator=(const AttackedChannel&) = delete;

  void Run(int64_t ms);
  /// Runs until that, or until `end_ms`. Returns whether it happened.
  bool RunUntil(const std::function<bool()>& happened, int64_t end_ms);
  /// Called after every millisecond.
  void OnMillisecond(std::function<void()> callback) { callback_ = std::move(callback); }
  int64_t now_ms() const { return medium_.now_ns() / 1'000'000; }
  /// When the next pause of jamming ends that has not begun yet.
  int64_t EndOfNextPause() const { return (now_ms() / kPeriodMs + 2) * kPeriodMs; }
  bool jams() const { return now_ms() % kPeriodMs < kJammingMs; }

  /// By its ID, 1 to kRobots.
  const sim::MobileRobot& robot(int id) const { return *robots_[static_cast<size_t>(id - 1)]; }
  /// Of robot 1.
  void LosePower();
  /// Another server takes over: with the state of the one before, its sessions not.
  void Restart();

  /// Whether all robots have one, if the link is signed.
  bool HasSessions() const;
  /// From now on.
  void Attack() { is_attacked_ = options_.is_attacked; }

  Status Issue(uint8_t id, protocol::CommandCode code);
  /// Of its last HELLO.
  uint16_t Nonce(uint8_t id);
  /// Whether the last command that was issued to it was accepted.
  bool Accepted(uint8_t id);
  /// What was issued to it until now, numbers and all.
  const std::vector<protocol::Command>& issued(uint8_t id) { return issued_[id]; }

  /// Quanta of type 1 beyond those of the path.
  std::map<Node, int64_t> Deposits();
  engine::Service& service() { return servers_.back().service; }
  /// EVENTs that no robot has sent.
  int forged_events() const;
  signing::SigningCounters Refused() const;
  radio::ChannelCounters counters() const { return servers_.back().station->counters(); }
  const sim::RadioMedium& medium() const { return medium_; }
  const Observer& observer(int id) const { return observers_[static_cast<size_t>(id - 1)]; }
  const Attacker& attacker() const { return attacker_; }

 private:
  // Keeps nothing, as VolatileLog, but goes on where another one has ended.
  struct Log final : engine::OrderedLog {
    explicit Log(uint64_t last) : sequence(last) {}
    protocol::Reason Admit() override { return protocol::Reason::kNone; }
    uint64_t Append(const engine::Stamp& stamp, const engine::Event& event) override;
    uint64_t DurableSequence() const override { return sequence; }
    bool WhenDurable(uint64_t /*sequence*/, std::function<void()> done) override {
      done();
      return true;
    }
    uint64_t sequence;
    int forged_events = 0;
  };
  struct Server {
    Server(AttackedChannel* channel, uint64_t start_ms, engine::Engine engine);
    Log log;
    engine::Service service;
    std::unique_ptr<signing::Signing> signing;
    std::unique_ptr<swarm::ServerStation> station;
  };

  void AddRobots();
  void HideObservers();
  void Step();
  std::map<Node, int64_t> Levels();

  ChannelOptions options_;
  bool is_attacked_ = false;
  sim::RadioMedium medium_;
  signing::Keys keys_;
  std::list<Server> servers_;  // the last one is on; the medium points at all
  std::vector<std::unique_ptr<sim::MobileRobot>> robots_;
  std::deque<Observer> observers_;  // of these
  Attacker attacker_;
  std::map<Node, int64_t> path_;
  std::map<uint8_t, std::vector<protocol::Command>> issued_;
  std::function<void()> callback_;
};

}  // namespace pheromone::attack
