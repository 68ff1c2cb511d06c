#include "client_fw/lab/firmware/firmware_swarm.h"

#include <algorithm>
#include <utility>

#include "client_fw/lab/firmware/channel.h"
#include "client_fw/lab/firmware/engine_server.h"
#include "client_fw/lab/phases.h"
#include "protocol/signing.h"
#include "server/base/hash.h"
#include "server/core/engine/wire_units.h"
#include "server/robots/radio/rounds.h"

namespace pheromone::lab {
namespace {

constexpr int64_t kRoundEveryMs = 1000;
constexpr size_t kStartsWithinMs = 1000;

bool HasIntensities(const std::optional<protocol::RoundAnswer>& answer) {
  return answer && answer->left != protocol::kNoIntensities;
}

// What is late may be of an earlier one of the same kind, as the robot's firmware finds out.
bool IsAnswer(const protocol::Message& request, const protocol::Message& message) {
  protocol::ErrorAnswer error;
  return Decode(message, &error) ? error.refused_opcode == request.opcode
                                 : message.opcode == (request.opcode | protocol::kFromServer);
}

// Of a TRACE.
void CountDeposit(const protocol::Message& request, const protocol::Message& answer,
                  bool in_process, StepOutcome* outcome) {
  protocol::TraceRequest trace;
  protocol::ErrorAnswer error;
  if (!Decode(request, &trace)) {
    return;
  }
  if (!Decode(answer, &error)) {
    ++outcome->deposited_quanta;
  } else if (in_process && error.reason == protocol::Reason::kMapFull) {
    outcome->map_full = true;
  } else {
    ++outcome->refused_deposits;
  }
}

}  // namespace

FirmwareSwarm::FirmwareSwarm(FirmwareConfig config)
    : config_(std::move(config)), mail_(config_.robots.size()), messages_(config_.robots.size()) {
  if (config_.radio) {
    link_.emplace(config_.robots.size(), *config_.radio, config_.seed);
  }
  const size_t count = config_.robots.size();
  const bool in_process = config_.server->field() != nullptr;
  const bool wide = engine::NeedsWide(config_.engine.field.map, config_.engine.pose_unit_10um);
  for (size_t i = 0; i < count; ++i) {
    client::Parameters robot = config_.robots[i];
    robot.id = static_cast<uint8_t>(1 + i % config_.server->robots_of_link());
    robot.start = client::Pose{0, 0, 0};
    robot.boot_counter = static_cast<uint16_t>(Hash64({config_.seed, i, 'b'}));
    if (const RobotSigning signing = config_.server->signing(i); signing.key != nullptr) {
      robot.key = signing.key;
      robot.boot_counter = signing.start;
    }
    robot.start_released = true;
    robot.wide = wide;
    robot.buffered_link = !in_process;
    robot.rounds = link_.has_value();
    Life& life = lives_.emplace_back(robot);
    life.start_ms = in_process ? 0 : static_cast<int64_t>(kStartsWithinMs * i / count);
    if (link_) {
      life.next = link_->First(i);
    }
  }
}

Result<std::shared_ptr<FirmwareSwarm>> FirmwareSwarm::Create(FirmwareConfig config) {
  if (config.server == nullptr) {
    PHEROMONE_TRY(config.server, EngineServer::Create(config.engine, config.robots.size()));
  }
  return std::shared_ptr<FirmwareSwarm>(new FirmwareSwarm(std::move(config)));
}

Status FirmwareSwarm::Act(const PheromoneView& view, const PheromoneActions& actions, size_t first,
                          size_t count) {
  for (size_t i = first; i < first + count; ++i) {
    FirmwareRobot& robot = lives_[i].robot;
    robot.See(sim::ToClientPose({view.x_m[i], view.y_m[i], view.heading_rad[i]}));
    const unsigned stops = robot.state().fail_safe_stops;
    if (const auto now_ms = static_cast<int64_t>(view.time_ms); now_ms >= lives_[i].start_ms) {
      Live(i, now_ms);
    }
    if (const unsigned more = robot.state().fail_safe_stops - stops; more != 0) {
      stops_ += more;
    }
    actions.left_m_s[i] = robot.wheels().left_mm_s / 1000.0;
    actions.right_m_s[i] = robot.wheels().right_mm_s / 1000.0;
  }
  return Ok();
}

protocol::Message FirmwareSwarm::Unsigned(size_t i, const protocol::Message& message) const {
  return lives_[i].robot.state().parameters.key != nullptr ? protocol::WithoutSignature(message)
                                                           : message;
}

// One turn of its loop; what it sends goes to the engine.
void FirmwareSwarm::Turn(size_t i, int64_t at_ms) {
  Life& life = lives_[i];
  life.clock_ms = std::max(life.clock_ms, at_ms);
  if (const protocol::Message* sent = life.robot.Step(static_cast<client::Moment>(life.clock_ms))) {
    messages_[i] = *sent;
    mail_[i] = Mail::kSent;
    life.in_turn = false;
  }
}

// Everything until now, and the turn of this step.
void FirmwareSwarm::Live(size_t i, int64_t now_ms) {
  Life& life = lives_[i];
  if (mail_[i] == Mail::kAnswered && !life.in_turn) {
    life.robot.Hear(messages_[i]);
    mail_[i] = Mail::kNone;
    if (link_) {
      HearRound(&life, now_ms, false, std::nullopt);
    } else if (HasIntensities(radio::InRound(Unsigned(i, messages_[i])))) {
      ++answers_;
    }
  }
  while (link_) {
    if (mail_[i] == Mail::kNone && life.next.ask_ms <= now_ms) {
      TakeTurn(i);
    } else if (mail_[i] == Mail::kAnswered && life.in_turn && life.next.answer_ms <= now_ms) {
      Answer(i, life.next.answer_ms);
    } else {
      break;
    }
  }
  if (link_ && mail_[i] == Mail::kNone && now_ms - life.round_ms >= kRoundEveryMs) {
    HearRound(&life, now_ms, false, std::nullopt);
  }
  Turn(i, now_ms);
}

void FirmwareSwarm::TakeTurn(size_t i) {
  Life& life = lives_[i];
  if (life.robot.greeted()) {
    HearRound(&life, life.next.ask_ms, true, std::nullopt);
    Turn(i, life.next.ask_ms - protocol::kBeforeTurnsMs);
    if (mail_[i] != Mail::kNone) {
      return;  // something else was sent first
    }
    Turn(i, life.clock_ms + protocol::kBeforeTurnsMs);
  }
  life.in_turn = mail_[i] == Mail::kSent;
  if (!life.in_turn) {
    life.next = link_->After(i, life.next);
  }
}

void FirmwareSwarm::Answer(size_t i, int64_t at_ms) {
  Life& life = lives_[i];
  if (life.heard_ms >= 0 && at_ms - life.heard_ms > kFailSafeMs) {
    Turn(i, at_ms - 1);  // before which it stops
  }
  const std::optional<protocol::RoundAnswer> answer = radio::InRound(messages_[i]);
  if (!answer) {
    life.robot.Hear(messages_[i]);
  }
  mail_[i] = Mail::kNone;
  HearRound(&life, at_ms, false,
            answer.value_or(protocol::RoundAnswer{protocol::kNoIntensities, 0}));
  Turn(i, at_ms);
  if (HasIntensities(answer)) {
    life.heard_ms = at_ms;
    ++answers_;
  }
  life.next = link_->After(i, life.next);
}

void FirmwareSwarm::HearRound(Life* life, int64_t at_ms, bool grant,
                              const std::optional<protocol::RoundAnswer>& answer) {
  protocol::Round round;
  round.number = ++life->number;
  round.turn_ms = kTurnMs;
  round.turn_bytes = client::kMaxClientFrame;
  round.slot_ms = kSlotMs;
  round.open_slots = protocol::kOpenUntilNextRound;  // for HELLO and EVENTs
  if (answer) {
    round.answers[round.answer_count++] = *answer;
  }
  if (grant) {
    round.turns[round.turn_count++] = life->robot.state().parameters.id;
  }
  protocol::Message message;
  Encode(round, &message);
  life->robot.Hear(message);
  life->round_ms = at_ms;
}

Result<StepOutcome> FirmwareSwarm::EndStep(uint64_t now_ms) {
  StepOutcome outcome;
  outcome.answers = answers_.exchange(0);
  outcome.fail_safe_stops = stops_.exchange(0);
  sent_.clear();
  received_.clear();
  for (size_t i = 0; i < mail_.size(); ++i) {
    if (mail_[i] == Mail::kSent) {
      sent_.push_back({i, messages_[i]});
      mail_[i] = Mail::kAsked;
    }
  }
  PHEROMONE_TRY_STATUS(config_.server->Exchange(static_cast<int64_t>(now_ms), sent_, &received_));
  for (const auto& [i, message] : received_) {
    const protocol::Message said = Unsigned(i, message);
    if (mail_[i] == Mail::kAsked && IsAnswer(messages_[i], said)) {
      CountDeposit(Unsigned(i, messages_[i]), said, field() != nullptr, &outcome);
      messages_[i] = message;
      mail_[i] = Mail::kAnswered;
    } else {
      lives_[i].robot.Hear(message);  // a command, or late
    }
  }
  if (link_) {
    std::replace(mail_.begin(), mail_.end(), Mail::kAsked, Mail::kNone);  // ignored
  }
  return outcome;
}

uint64_t FirmwareSwarm::Hash() const {
  uint64_t sum = config_.server->Hash();
  for (size_t i = 0; i < lives_.size(); ++i) {
    const client::BehaviourState& state = lives_[i].robot.state();
    sum +=
        Hash64({'f', i, static_cast<uint64_t>(state.p_left), static_cast<uint64_t>(state.p_right),
                state.flags, state.fail_safe_stops, static_cast<uint64_t>(lives_[i].heard_ms)});
  }
  return sum;
}

}  // namespace pheromone::lab
