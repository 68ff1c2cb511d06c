#include "client_fw/lab/firmware/firmware_swarm.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

#include "client_fw/lab/phases.h"
#include "server/base/hash.h"
#include "server/core/engine/wire_units.h"
#include "server/robots/radio/rounds.h"
#include "server/robots/radio/timing.h"

namespace pheromone::lab {
namespace {

constexpr size_t kRobotsOfLink = 254;
constexpr uint16_t kEpoch = 1;
constexpr int64_t kRoundEveryMs = 1000;
// As on the channel on which rounds were measured (link/measured_rounds.h), with carrier detect.
constexpr uint32_t kBaud = client::Parameters().baud;
constexpr radio::Duration kTwoMs(2'000'000);
constexpr radio::Timing kTiming{
    .byte = radio::ByteTime(kBaud), .turnaround = kTwoMs, .processing = kTwoMs};

constexpr uint8_t WholeMs(radio::Duration time) {
  return static_cast<uint8_t>((time.count() + 999'999) / 1'000'000);
}
constexpr uint8_t kSlotMs = WholeMs(kTiming.turnaround);
constexpr uint8_t kWindowMs = WholeMs(kTiming.ResponseWindow());
constexpr uint8_t kTurnMs = client::BytesMs(client::kMaxClientFrame, kBaud);

engine::EngineConfig WithLinks(engine::EngineConfig engine, size_t robots) {
  for (size_t first = 0; first < robots; first += kRobotsOfLink) {
    engine.links.push_back(
        {fmt::format("radio-{}", first / kRobotsOfLink + 1), kSlotMs, kWindowMs});
  }
  return engine;
}

bool HasIntensities(const std::optional<protocol::RoundAnswer>& answer) {
  return answer && answer->left != protocol::kNoIntensities;
}

// Of a TRACE.
void CountDeposit(const protocol::Message& request, const protocol::Message& answer,
                  StepOutcome* outcome) {
  protocol::TraceRequest trace;
  protocol::ErrorAnswer error;
  if (!Decode(request, &trace)) {
    return;
  }
  if (!Decode(answer, &error)) {
    ++outcome->deposited_quanta;
  } else if (error.reason == protocol::Reason::kMapFull) {
    outcome->map_full = true;
  } else {
    ++outcome->refused_deposits;
  }
}

}  // namespace

FirmwareSwarm::FirmwareSwarm(FirmwareConfig config)
    : config_(std::move(config)),
      mail_(config_.robots.size()),
      messages_(config_.robots.size()),
      service_(&log_, [this] {
        return engine::ClockReading{static_cast<uint64_t>(now_ms_), now_ms_};
      }) {
  if (config_.radio) {
    link_.emplace(config_.robots.size(), *config_.radio, config_.seed);
  }
  const bool wide = engine::NeedsWide(config_.engine.field.map, config_.engine.pose_unit_10um);
  for (size_t i = 0; i < config_.robots.size(); ++i) {
    client::Parameters robot = config_.robots[i];
    robot.id = static_cast<uint8_t>(1 + i % kRobotsOfLink);
    robot.start = client::Pose{0, 0, 0};
    robot.boot_counter = static_cast<uint16_t>(Hash64({config_.seed, i, 'b'}));
    robot.start_released = true;
    robot.wide = wide;
    robot.rounds = link_.has_value();
    Life& life = lives_.emplace_back(robot);
    if (link_) {
      life.next = link_->First(i);
    }
  }
}

Result<std::shared_ptr<FirmwareSwarm>> FirmwareSwarm::Create(FirmwareConfig config) {
  config.engine = WithLinks(std::move(config.engine), config.robots.size());
  std::shared_ptr<FirmwareSwarm> swarm(new FirmwareSwarm(std::move(config)));
  PHEROMONE_TRY(const auto configured, swarm->service_.Configure(swarm->config_.engine, kEpoch));
  (void)configured;
  return swarm;
}

Status FirmwareSwarm::Act(const PheromoneView& view, const PheromoneActions& actions, size_t first,
                          size_t count) {
  for (size_t i = first; i < first + count; ++i) {
    FirmwareRobot& robot = lives_[i].robot;
    robot.See(sim::ToClientPose({view.x_m[i], view.y_m[i], view.heading_rad[i]}));
    const unsigned stops = robot.state().fail_safe_stops;
    Live(i, static_cast<int64_t>(view.time_ms));
    if (const unsigned more = robot.state().fail_safe_stops - stops; more != 0) {
      stops_ += more;
    }
    actions.left_m_s[i] = robot.wheels().left_mm_s / 1000.0;
    actions.right_m_s[i] = robot.wheels().right_mm_s / 1000.0;
  }
  return Ok();
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
    } else if (HasIntensities(radio::InRound(messages_[i]))) {
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
  now_ms_ = static_cast<int64_t>(now_ms);
  StepOutcome outcome;
  outcome.answers = answers_.exchange(0);
  outcome.fail_safe_stops = stops_.exchange(0);
  std::vector<engine::Outgoing> out;
  service_.AdvanceIfDue(&out);
  std::vector<protocol::Message> batch;
  for (size_t first = 0; first < mail_.size(); first += kRobotsOfLink) {
    const size_t end = std::min(first + kRobotsOfLink, mail_.size());
    batch.clear();
    for (size_t i = first; i < end; ++i) {
      if (mail_[i] == Mail::kSent) {
        batch.push_back(messages_[i]);
        mail_[i] = Mail::kAsked;
      }
    }
    if (!batch.empty()) {
      service_.Handle(static_cast<engine::LinkIndex>(first / kRobotsOfLink), batch, &out);
    }
  }
  for (const engine::Outgoing& outgoing : out) {
    const size_t i = outgoing.link * kRobotsOfLink + outgoing.message.id - 1u;
    if (i < mail_.size() && mail_[i] == Mail::kAsked) {
      CountDeposit(messages_[i], outgoing.message, &outcome);
      messages_[i] = outgoing.message;
      mail_[i] = Mail::kAnswered;
    }
  }
  std::replace(mail_.begin(), mail_.end(), Mail::kAsked, Mail::kNone);  // not answered: ignored
  return outcome;
}

uint64_t FirmwareSwarm::Hash() const {
  uint64_t sum = service_.StateHash();
  for (size_t i = 0; i < lives_.size(); ++i) {
    const client::BehaviourState& state = lives_[i].robot.state();
    sum +=
        Hash64({'f', i, static_cast<uint64_t>(state.p_left), static_cast<uint64_t>(state.p_right),
                state.flags, state.fail_safe_stops, static_cast<uint64_t>(lives_[i].heard_ms)});
  }
  return sum;
}

}  // namespace pheromone::lab
