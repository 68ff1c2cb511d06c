#include "server/verify/conversation_world.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "server/base/bytes.h"
#include "server/engine/event_codec.h"

namespace pheromone::verify {
namespace {

using protocol::Message;

constexpr uint8_t kRobot = 1;
constexpr uint8_t kType = 1;
constexpr int32_t kBetweenMm = 100;  // each change is made at a place of its own
constexpr uint32_t kPatienceMs = 30'000;
constexpr uint32_t kSilenceMs = 30'000;

engine::EngineConfig ConfigFor(const ConversationLimits& limits) {
  field::PheromoneLaw law;
  law.type = kType;
  law.name = "path";
  law.core_um = 100'000;
  law.sigma_um = 100'000;
  law.tau_ms = 0;  // what was deposited stays
  law.quantum_micro = 125'000;
  law.max_count = 8;
  engine::EngineConfig config;
  config.field.map = {
      .origin = {0, 0}, .width_um = 1'000'000, .height_um = 100'000, .cell_um = 100'000};
  config.field.antennas.distance_um = 100'000;
  config.field.pheromones = {law};
  config.field.memory_bytes = 1 << 20;
  config.links = {{"radio-a", 1, 40}};
  config.robots_per_link = limits.robots_per_link;
  return config;
}

void WriteMessages(const std::vector<Message>& messages, ByteWriter* writer) {
  std::vector<std::string> all;
  for (const Message& message : messages) {
    ByteWriter one;
    EncodeFields(message, &one);
    all.push_back(one.Take());
  }
  std::sort(all.begin(), all.end());  // any of them may be next
  writer->Count(all.size());
  for (const std::string& one : all) {
    writer->Text(one);
  }
}

// Of a robot in the engine, what the next answers depend on.
void WriteRobot(const engine::RobotState* robot, ByteWriter* writer) {
  writer->Flag(robot != nullptr);
  if (robot != nullptr) {
    writer->U16(robot->epoch);
    writer->U16(robot->nonce);
    writer->U16(robot->previous_nonce.value_or(0));
    writer->Flag(robot->has_last);
    writer->U8(robot->last_opcode);
    writer->U8(robot->last_seq);
    writer->U16(robot->last_crc);
    EncodeFields(robot->last_answer, writer);
  }
}

}  // namespace

client::Parameters ConversationWorld::ParametersAt(uint16_t boot_counter) {
  client::Parameters parameters{};
  parameters.id = kRobot;
  parameters.type = kType;
  parameters.lay_trail = true;
  parameters.start_released = true;
  parameters.boot_counter = boot_counter;
  return parameters;
}

ConversationWorld::ConversationWorld(const ConversationLimits& limits)
    : left_(limits),
      robot_(ParametersAt(boot_counter_), &memory_),
      acknowledged_(static_cast<size_t>(limits.changes)) {
  Engine engine;
  std::vector<engine::Outgoing> none;
  engine.Apply(1, {1, 0}, engine::ConfigChanged{ConfigFor(limits), 7}, &none);
  server_ = SharedEngine::Of(std::move(engine));
  durable_ = server_;
}

ConversationWorld::ConversationWorld(const ConversationWorld& other)
    : left_(other.left_),
      memory_(other.memory_),
      boot_counter_(other.boot_counter_),
      robot_(other.robot_, &memory_),
      now_ms_(other.now_ms_),
      server_(other.server_),
      durable_(other.durable_),
      held_(other.held_),
      to_server_(other.to_server_),
      to_robot_(other.to_robot_),
      made_(other.made_),
      acknowledged_(other.acknowledged_),
      pending_(other.pending_) {}

std::string ConversationWorld::Key() const {
  ByteWriter writer;
  for (const int left : {left_.changes, left_.warm_resets, left_.power_losses, left_.crashes,
                         left_.silences, left_.other_robots, made_, pending_}) {
    writer.U8(static_cast<uint8_t>(left));
  }
  writer.U16(memory_.nonce);
  writer.U16(memory_.epoch);
  writer.U8(memory_.seq);
  writer.U8(memory_.opcode);
  for (uint8_t i = 0; memory_.opcode != 0 && i < memory_.length; ++i) {
    writer.U8(memory_.data[i]);
  }
  writer.Flag(memory_.numbered);
  writer.Flag(robot_.greeted());
  writer.U8(robot_.flags());
  writer.Flag(robot_.has_event());
  writer.Flag(robot_.event_turn());
  writer.U8(robot_.awaited_opcode());
  for (const auto* const engine : {&server_, &durable_}) {
    WriteRobot((**engine)->robots().Find(0, kRobot), &writer);
    writer.Flag((**engine)->robots().Find(0, kRobot + 1) != nullptr);
    for (int change = 0; change < made_; ++change) {  // nothing else changes the map
      writer.U32(DepositsAt(***engine, change));
    }
  }
  writer.Flag(server_ == durable_);
  WriteMessages(held_, &writer);
  WriteMessages(to_server_, &writer);
  WriteMessages(to_robot_, &writer);
  for (const bool acknowledged : acknowledged_) {
    writer.Flag(acknowledged);
  }
  return writer.Take();
}

uint32_t ConversationWorld::DepositsAt(const Engine& engine, int change) {
  const uint32_t level = engine.field().LevelOf(kType, {change, 0}, engine.field_time_ms());
  return level / field::kLevelsPerQuantum;
}

std::string ConversationWorld::Wrong() const {
  for (int change = 0; change < made_; ++change) {
    const uint32_t deposits = DepositsAt(**server_, change);
    if (deposits > 1) {
      return "change " + std::to_string(change) + " was made " + std::to_string(deposits) +
             " times";
    }
    if (deposits == 0 && acknowledged_[static_cast<size_t>(change)]) {
      return "change " + std::to_string(change) + " was acknowledged and is gone";
    }
  }
  return "";
}

// Lets time pass until the robot sends, with its next change if it has one to make. HELLO after a
// silence is not sent here, but after HearNothing.
bool ConversationWorld::Send() {
  const bool was_greeted = robot_.greeted();
  for (uint32_t waited = 0; waited < kPatienceMs; ++waited) {
    client::Odometry odometry{};
    odometry.x_mm = made_ * kBetweenMm;
    ++now_ms_;
    const uint8_t seq_before = memory_.seq;
    robot_.Poll(now_ms_, left_.changes > 0 ? &odometry : nullptr, false);
    if (robot_.tx_size() == 0) {
      continue;
    }
    protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
    Message sent;
    decoder.PushBlock(robot_.tx(), robot_.tx_size(), 0, [&](const Message& it) { sent = it; });
    robot_.OnSent(now_ms_);
    if (was_greeted && !robot_.greeted()) {
      return false;
    }
    if (memory_.seq != seq_before) {
      const bool is_trace = protocol::ServiceOf(sent.opcode) == protocol::kTrace;
      left_.changes -= is_trace ? 1 : 0;
      pending_ = is_trace ? made_++ : -1;  // or an EVENT
    }
    to_server_.push_back(sent);
    return true;
  }
  return false;
}

// The channel is busy so long that all its timers run down.
void ConversationWorld::HearNothing() {
  --left_.silences;
  now_ms_ += kSilenceMs;
  robot_.Poll(now_ms_, nullptr, true);
}

void ConversationWorld::Arrive(size_t frame, bool also_later) {
  const Message message = to_server_[frame];
  if (!also_later) {
    to_server_.erase(to_server_.begin() + static_cast<ptrdiff_t>(frame));
  }
  std::vector<engine::Outgoing> out;
  switch ((*server_)->Classify(0, message)) {
    case engine::Handling::kIgnore:
      break;
    case engine::Handling::kAnswer:
      (*server_)->Answer({1, 0}, 0, message, &out);
      break;
    case engine::Handling::kChange:
      server_ = server_->After(0, message, &out);
      break;
  }
  for (const engine::Outgoing& answer : out) {
    const bool waits = answer.durable_at > (*durable_)->sequence();
    std::vector<Message>& to = waits ? held_ : to_robot_;
    if (waits) {
      to.clear();  // one for each robot, to its latest request (held_answers.h)
    }
    to.push_back(answer.message);
  }
}

void ConversationWorld::Hear(size_t frame, bool also_later) {
  const Message message = to_robot_[frame];
  if (!also_later) {
    to_robot_.erase(to_robot_.begin() + static_cast<ptrdiff_t>(frame));
  }
  uint8_t wire[protocol::kMaxFrame];
  const size_t size = protocol::EncodeFrame(message, wire, sizeof wire);
  const uint8_t pending_opcode = memory_.opcode;
  const bool is_error = message.opcode == protocol::kError;
  for (size_t i = 0; i < size; ++i) {
    robot_.OnByte(wire[i], now_ms_);
  }
  if (pending_opcode != 0 && memory_.opcode == 0) {
    if (pending_ >= 0 && !is_error && message.opcode == (pending_opcode | protocol::kFromServer)) {
      acknowledged_[static_cast<size_t>(pending_)] = true;
    }
    pending_ = -1;
  }
}

void ConversationWorld::Sync() {
  durable_ = server_;
  to_robot_.insert(to_robot_.end(), held_.begin(), held_.end());
  held_.clear();
}

// All that was acknowledged is durable, so the epoch stays.
void ConversationWorld::Crash() {
  --left_.crashes;
  server_ = durable_;
  held_.clear();
}

void ConversationWorld::Reset(bool keeps_memory) {
  if (keeps_memory) {
    --left_.warm_resets;
    memory_.numbered = memory_.numbered && !left_.takes_numbers_back;
  } else {
    --left_.power_losses;
    ++boot_counter_;
    memory_ = client::RequestMemory{};
    pending_ = -1;
  }
  robot_ = client::Conversation(ParametersAt(boot_counter_), &memory_);
}

void ConversationWorld::OtherHello() {
  --left_.other_robots;
  Message hello;
  protocol::Encode(protocol::HelloRequest{kRobot + 1, 9, 1, 0}, &hello);
  std::vector<engine::Outgoing> ignored;
  if ((*server_)->Classify(0, hello) == engine::Handling::kChange) {
    server_ = server_->After(0, hello, &ignored);
  }
}

void ConversationWorld::Next(const Visit& visit) const {
  const auto step = [&](const std::string& name, const auto& act) {
    ConversationWorld next(*this);
    act(&next);
    if (next.to_server_.size() <= left_.in_flight && next.to_robot_.size() <= left_.in_flight) {
      visit(name, std::move(next));
    }
  };
  {
    ConversationWorld next(*this);
    if (next.Send() && next.to_server_.size() <= left_.in_flight) {
      visit("the robot sends " + std::to_string(next.to_server_.back().opcode), std::move(next));
    }
  }
  for (size_t i = 0; i < to_server_.size(); ++i) {
    const std::string what = "request " + std::to_string(to_server_[i].opcode);
    step(what + " arrives", [i](ConversationWorld* it) { it->Arrive(i, false); });
    step(what + " arrives and is repeated", [i](ConversationWorld* it) { it->Arrive(i, true); });
    step(what + " is lost", [i](ConversationWorld* it) {
      it->to_server_.erase(it->to_server_.begin() + static_cast<ptrdiff_t>(i));
    });
  }
  for (size_t i = 0; i < to_robot_.size(); ++i) {
    const std::string what = "answer " + std::to_string(to_robot_[i].opcode);
    step(what + " arrives", [i](ConversationWorld* it) { it->Hear(i, false); });
    step(what + " arrives and is repeated", [i](ConversationWorld* it) { it->Hear(i, true); });
    step(what + " is lost", [i](ConversationWorld* it) {
      it->to_robot_.erase(it->to_robot_.begin() + static_cast<ptrdiff_t>(i));
    });
  }
  if (server_ != durable_) {
    step("the log is synced", [](ConversationWorld* it) { it->Sync(); });
    if (left_.crashes > 0) {
      step("the server crashes", [](ConversationWorld* it) { it->Crash(); });
    }
  }
  if (left_.silences > 0 && robot_.greeted()) {
    step("the robot hears nothing", [](ConversationWorld* it) { it->HearNothing(); });
  }
  if (left_.warm_resets > 0) {
    step("the robot is reset", [](ConversationWorld* it) { it->Reset(true); });
  }
  if (left_.power_losses > 0) {
    step("the robot loses power", [](ConversationWorld* it) { it->Reset(false); });
  }
  if (left_.other_robots > 0) {
    step("another robot says HELLO", [](ConversationWorld* it) { it->OtherHello(); });
  }
}

Explored ExploreConversation(const ConversationLimits& limits, size_t max_states) {
  return Explore<ConversationWorld>(
      ConversationWorld(limits),
      {.key = [](const ConversationWorld& it) { return it.Key(); },
       .next = [](const ConversationWorld& it, const auto& visit) { it.Next(visit); },
       .wrong = [](const ConversationWorld& it) { return it.Wrong(); },
       .finished = [](const ConversationWorld& it) { return it.Finished(); },
       .must_finish = [](const ConversationWorld& it) { return it.MustFinish(); },
       .max_states = max_states});
}

}  // namespace pheromone::verify
